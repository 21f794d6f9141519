"""Weights, resampling, Kalman and least squares: pure numpy, no robot, no events."""
