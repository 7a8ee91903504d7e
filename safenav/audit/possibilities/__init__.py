"""The team's possibilities at a line: reachable poses, duties, lower bounds on times."""
