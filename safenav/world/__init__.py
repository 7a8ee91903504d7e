"""The world: maps of regions and how robots move on them."""
