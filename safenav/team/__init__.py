"""The team and its one model: members, state, events and the transition between states."""
