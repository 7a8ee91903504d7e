"""Before and after a run: foresight, rehearsal, repairs."""
