"""Maps in files: images, ROS map_server, MovingAI."""
