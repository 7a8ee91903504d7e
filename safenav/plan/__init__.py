"""Joint plans, or the proof that there are none."""
