"""Continuous motion of each robot of a run, in metres and seconds (docs/motion.md).

Needs the extra ``motion`` (numpy, daqp). This file imports nothing, so commands without motion stay
fast.
"""
