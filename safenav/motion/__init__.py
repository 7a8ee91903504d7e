"""Continuous motion of each robot of a run, in metres and seconds (docs/motion.md).

Needs the extra ``motion`` (numpy, daqp). Nothing is imported here, so that the commands that do
not move anybody stay fast.
"""
