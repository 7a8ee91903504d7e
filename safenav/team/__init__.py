"""The only model of a team: members, state, events and transition function."""
