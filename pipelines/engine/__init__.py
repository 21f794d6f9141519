"""Knows no robot: how stages are configured, checked, chained, timed, and explained when they fail."""
