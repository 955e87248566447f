"""Processes of our own: workers that share the work, interruption, one run at a time in a folder."""
