"""Proofs of negatives, checked by code of its own: closures, trees of choices, joint searches."""
