"""YAML text as nodes with their places, and its errors."""
