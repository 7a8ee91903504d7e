"""Actual worlds: their protocols, the simulated ones, and the commands of a run to them."""
