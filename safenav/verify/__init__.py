"""Check of an automaton against the text of its specification."""
