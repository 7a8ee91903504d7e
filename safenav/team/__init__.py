"""The team and its one model: who can do what (team), what is so (state), what follows (apply,
floor)."""
