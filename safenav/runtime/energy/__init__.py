"""Batteries: charges, charging stops, and robots with an empty battery."""
