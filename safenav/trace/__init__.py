"""The trace: the events of a run as data (docs/trace.md)."""
