"""The rules of a trace, one module for each concern."""
