"""Terminal output: story, maps, tables and warnings."""
