"""What writes into the log of a run: each sensor a function of the run, also the truth."""
