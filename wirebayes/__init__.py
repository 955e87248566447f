"""A Bayesian toolkit for wires that creep."""

__version__ = "0.1.0"
