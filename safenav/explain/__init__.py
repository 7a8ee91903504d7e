"""Explanations of unrealizability, shown on the map, and repairs."""
