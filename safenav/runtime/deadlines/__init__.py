"""Promises in ticks: what can be kept, when each is kept, broken or lost."""
