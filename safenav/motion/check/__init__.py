"""Checks of a motion file: against its trace, by independent rules and code, and against the
requirements of its scenario.

The rules use only the file format of the rest of ``safenav.motion``: geometry, dynamics,
reservations and order are recomputed from docs/motion.md.
"""
