"""Simulation-based calibration of prior, simulator, likelihood and sampler together.

``python -m analyses.calibration --output out/calibration`` (two workers; resumes where it was stopped).
"""
