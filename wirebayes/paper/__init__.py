"""The paper reproduced: its wires fitted, its tables beside ours, its figures with their uncertainty."""
