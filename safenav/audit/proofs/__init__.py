"""Independent checks of infeasibility proofs: closures, trees of choices, joint searches."""
