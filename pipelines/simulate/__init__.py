"""Worlds, robots and sensors: logs with a known truth, from forward models that share nothing with the estimators."""
