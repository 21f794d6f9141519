"""Trajectories: each format read and written, and any of them told by its content."""
