"""The cases of a batch: where they come from, how they vary."""
