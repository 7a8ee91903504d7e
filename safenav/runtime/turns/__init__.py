"""One robot's turn: the step it takes, its actions, and what follows from their ends."""
