"""Actual worlds: their protocols, the simulated worlds, and a run's commands to them."""
