"""What robots that share a floor do with collisions: joint plans, or the proof that there are
none."""
