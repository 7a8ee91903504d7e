"""Robots in pyrobosim, an external simulator, in a separate process."""
