"""A lab in MuJoCo, with simulated robots in place of real ones."""
