"""The run model: a trace's content as robots, obstacles, requests and events over time."""
