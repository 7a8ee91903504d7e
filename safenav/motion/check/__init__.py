"""Judges a motion file against its trace, by rules and code of its own.

Of the rest of ``safenav.motion`` it uses the file format alone: geometry, dynamics, reservations
and order are computed anew from docs/motion.md.
"""
