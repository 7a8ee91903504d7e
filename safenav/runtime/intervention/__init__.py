"""Interventions: a user's changes during a run, as data, read from words, and applied."""
