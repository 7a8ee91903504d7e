"""Batteries: what charge a robot needs, its charging trips, and flat robots."""
