"""logpose: from logs to poses.

Reads what a robot logged (ROS 1 bag, ROS 2 bag, MCAP, image folders), runs a localisation or mapping method over it
offline, and writes the trajectory, the map and a report of the error. ``cli`` parses words, ``pipelines`` holds the
methods and the engine that chains them, ``formats`` reads and writes every file.
"""

__version__ = "0.1.0"
