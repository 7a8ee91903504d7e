"""Proofs of negatives: tables that are checked locally, and bounded enumerations."""
