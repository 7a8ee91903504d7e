"""Terminal output: story, maps, tables, warnings."""
