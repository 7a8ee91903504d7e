"""Scenarios: the data model, the catalogue of robots and obstacles, the YAML loader."""
