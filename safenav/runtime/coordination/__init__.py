"""Coordination: duties of the robots, derived from the team's knowledge (docs/coordination.md)."""
