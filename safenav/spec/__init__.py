"""Compiler from a robot's objective to a GR(1) specification in structured slugs."""
