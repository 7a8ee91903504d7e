"""The motion file: JSON Lines, metres, seconds, radians (docs/motion.md)."""
