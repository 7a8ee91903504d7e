"""Batteries: what charge a robot needs, its charging stops, and flat robots."""
