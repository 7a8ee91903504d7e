"""The studio: one page on this machine that draws a scenario and shows its run as it happens."""
