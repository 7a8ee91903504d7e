"""Coordination: who does what, derived from what the team knows (docs/coordination.md)."""
