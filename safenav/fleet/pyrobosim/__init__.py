"""Robots in pyrobosim, a simulator of somebody else's making, in a process of its own."""
