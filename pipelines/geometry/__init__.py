"""Angles, rigid motions, cameras: pure numpy, no events."""
