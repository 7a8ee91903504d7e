"""Checks of a motion file: against its trace, its own rules, and its scenario's requirements.

The rules use the file's format, its mathematics (``geometry``, ``columns``) and its trace's times
(``timing``), but no code that computes motions.
"""
