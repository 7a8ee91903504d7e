"""YAML text as nodes that know their place, and what is wrong with it."""
