"""From regions to metres."""
