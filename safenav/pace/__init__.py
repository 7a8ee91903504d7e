"""Durations of steps by kind of motion, light enough for the runtime."""
