"""Joint plans of robots that share a floor, or the proof that there are none."""
