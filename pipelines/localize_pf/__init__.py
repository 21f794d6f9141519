"""Where a robot is under identical landmarks: a particle filter over odometry and sightings."""
