"""From regions to metres: how each robot of a run moves in continuous time (docs/motion.md).

Needs the extra ``motion`` (numpy, daqp). Nothing is imported here, so that the commands that do
not move anybody stay fast.
"""
