"""An automaton checked against the text of its specification."""
