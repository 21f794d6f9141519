"""Association, alignment and errors of trajectories against a reference."""
