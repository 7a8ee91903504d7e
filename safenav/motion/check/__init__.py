"""Judges a motion file against its trace, by rules and code of its own.

It uses only the file format of the rest of ``safenav.motion``: geometry, dynamics, reservations
and order are recomputed from docs/motion.md.
"""
