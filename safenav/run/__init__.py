"""The run model: a trace as robots, obstacles, requests and events over time."""
