"""Real robots: regions to metres and back, and the transports that drive them."""
