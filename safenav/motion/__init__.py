"""Continuous motion of each robot of a run, in metres and seconds (docs/motion.md).

Needs the extra ``motion`` (numpy, daqp). Nothing is imported here, so that commands without motion
stay fast.
"""
