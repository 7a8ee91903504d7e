"""The fleet file: the connection, sensors and actions of each robot."""
