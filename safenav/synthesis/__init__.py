"""Synthesis of strategies: the subprocess, its cache, and the automaton."""
