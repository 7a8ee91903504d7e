"""Interventions: what a user changes during a run, as data, read from words, and applied."""
