"""Before and after a run: foresight, rehearsal, what would have helped."""
