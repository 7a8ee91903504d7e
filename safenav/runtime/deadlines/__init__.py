"""Deadlines in ticks: which can be met, and by which acts. Pure functions."""
