"""The synthesis of strategies: the subprocess, its cache and the resulting automaton."""
