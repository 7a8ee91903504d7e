"""Batteries: what charge a robot needs, its errands to chargers, and flat robots."""
