"""Other robots as the environment of one: nearby, exact, belief."""
