"""The rules that a bundle adds to the judge: its strategies obey the scenario, and the run follows
them."""
