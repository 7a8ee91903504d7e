"""Correct-by-construction controllers for teams of heterogeneous robots."""

__version__ = "0.1.0"
