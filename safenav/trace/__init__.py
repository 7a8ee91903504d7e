"""The trace: what happens in a run, as data (docs/trace.md)."""
