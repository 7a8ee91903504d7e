"""Conversion of YAML to a scenario, item by item."""
