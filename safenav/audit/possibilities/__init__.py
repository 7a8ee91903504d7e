"""Possibilities of the team at a line: reachable poses, duties, lower bounds on times."""
