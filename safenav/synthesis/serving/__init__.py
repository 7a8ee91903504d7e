"""Strategies that are not listed: slugs keeps its diagrams and returns one move at a time."""
