"""Transports over ROS 1, and over ROS 2 without an installation of it."""
