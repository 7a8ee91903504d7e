"""Reports of a batch for people and CI."""
