"""The paper reproduced: its wires fitted, its tables beside ours, its figures with what is known and what is not."""
