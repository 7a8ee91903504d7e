"""From a specification to a strategy: the subprocess, its cache, and the automaton."""
