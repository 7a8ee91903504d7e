"""Proofs of what a team can never do: tables that are checked locally, and bounded enumerations."""
