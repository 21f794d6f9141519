"""Messages of odometry become increments and corrected steps with their noise; start poses; dead reckoning."""
