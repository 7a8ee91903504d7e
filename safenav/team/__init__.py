"""The only model of a team: members, state, events, and the transition between states."""
