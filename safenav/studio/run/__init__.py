"""A live run: its process, and what is told of it to the pages."""
