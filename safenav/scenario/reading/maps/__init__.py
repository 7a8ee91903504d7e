"""Maps of scenarios: drawn in the file, images, ROS map_server, MovingAI."""
