"""What users write, read strictly: every complaint names the place, what was found and what was expected."""
