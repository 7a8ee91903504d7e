"""Signal temporal logic over the motion of a run: syntax, parser and robustness."""
