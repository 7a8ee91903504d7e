"""When each robot moves: the dependency graph of a run, its schedule, its longest chain."""
