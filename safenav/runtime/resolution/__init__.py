"""Resolvable obstacles and the order of acts: pure functions of poses, stages, capabilities."""
