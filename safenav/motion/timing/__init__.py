"""Timing of all robots: the dependency graph of a run, and its schedule."""
