"""Timing of all robots: the dependency graph of a run, its schedule, its critical path."""
