"""What a terminal shows: story, maps, tables, warnings."""
