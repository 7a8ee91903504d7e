"""The rules that a bundle adds to the judge: its strategies are right, and the run follows them."""
