"""The cases of a batch: their search and their variations."""
