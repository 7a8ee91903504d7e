"""The judge's additional rules for a bundle: its strategies obey the scenario, and the run follows
them."""
