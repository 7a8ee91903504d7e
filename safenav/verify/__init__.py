"""The check of an automaton against its specification."""
