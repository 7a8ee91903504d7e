"""Strategies on demand: slugs keeps its diagrams and returns one move at a time."""
