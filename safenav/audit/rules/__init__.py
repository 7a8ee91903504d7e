"""Rules of a trace, one module per concern."""
