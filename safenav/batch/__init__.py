"""Batches: find scenarios, run them in parallel, compare each run with its expectations."""
