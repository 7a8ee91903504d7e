"""Conversion of YAML to a scenario: one module for each item."""
