"""Stripe marks in a report: what is kept of them, their pictures, their table, and their part of the log."""
