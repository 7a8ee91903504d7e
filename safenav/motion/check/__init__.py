"""Checks of a motion file: against its trace, by rules of its own, and against the requirements of
its scenario.

The rules use the format of the file, its mathematics (``geometry``, ``columns``) and the times of
its trace (``timing``), but no code that computes motions.
"""
