"""Promises of a running mission: their begin, their course, their refusal (docs/deadlines.md)."""
