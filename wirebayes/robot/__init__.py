"""A parallel robot hung on wires that creep: statics, kinematics, drift, calibration.

The rooms below import `wirebayes.wire` and numpy/scipy only; posterior draws arrive as plain arrays.
"""
