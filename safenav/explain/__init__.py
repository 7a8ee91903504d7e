"""Why a robot has no strategy, shown on the map, and what would give it one."""
