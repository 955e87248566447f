"""Coordinates in which posteriors are sampled, each with its Jacobian."""
