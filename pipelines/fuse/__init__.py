"""Sightings of stripe marks and odometry become a trajectory: a Kalman filter along the log, a smoother after it."""
