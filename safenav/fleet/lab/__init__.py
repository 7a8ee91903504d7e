"""A lab in MuJoCo: robots of a simulation in place of real ones."""
