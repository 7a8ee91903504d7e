"""A run as a ROS 2 bag in MCAP, for Foxglove, RViz and `ros2 bag play`."""
