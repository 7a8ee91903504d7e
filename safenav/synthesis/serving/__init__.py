"""A strategy that nobody lists: slugs keeps its diagrams and answers one move at a time."""
