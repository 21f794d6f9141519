"""Landmarks in a report: what is kept of them, their pictures, and their part of the log."""
