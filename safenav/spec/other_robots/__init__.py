"""Other robots as the environment of one: tracked (exact, belief) or avoided (nearby)."""
