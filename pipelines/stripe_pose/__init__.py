"""Pose from bars: where a camera stands before marks of vertical stripes, from one row of the image and more."""
