"""The state of a run at a line of its trace."""
