"""Deadlines of a running mission: start, monitoring, refusal (docs/deadlines.md)."""
