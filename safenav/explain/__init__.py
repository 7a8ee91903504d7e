"""Explanations of unrealizability on the map, and repairs."""
