"""Transport to robots over ROS 2, without an installation of it."""
