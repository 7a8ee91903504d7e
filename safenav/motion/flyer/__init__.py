"""A quadcopter: its reference, and how it follows that in wind."""
