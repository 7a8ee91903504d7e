"""The joint search: plans and proofs for a team, computed from data alone."""
