"""The editor: a scenario's text, its drawing and the operations on it."""
