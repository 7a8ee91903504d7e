"""Promises in ticks: which can be kept, and by which acts. Pure functions."""
