"""The run model: the content of a trace as robots, obstacles, requests and events over time."""
