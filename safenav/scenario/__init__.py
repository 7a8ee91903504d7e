"""Scenarios: the data model, the catalogue of robots and obstacles, and the YAML loader."""
