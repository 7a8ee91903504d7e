"""The coordination layer: missions, their parts and the trace."""
