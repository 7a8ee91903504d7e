"""The transport to robots over ROS 2, without its installation."""
