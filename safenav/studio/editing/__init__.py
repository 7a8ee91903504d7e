"""The editor: the text of a scenario, what it draws, and what changes it."""
