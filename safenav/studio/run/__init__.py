"""A live run: its process, and its messages to the pages."""
