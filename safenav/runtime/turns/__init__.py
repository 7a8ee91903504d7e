"""One robot's turn: its step, its actions, and the consequences of their ends."""
