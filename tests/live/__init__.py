"""Missions in continuous time: a world of its own, faults, and a judge of the world's log alone.

``floor`` is the world, plain data in and out, so that it may stand behind a socket; ``judge`` reads
its log; ``campaign`` plays random missions. They share no code with safenav's simulation and audit.
"""
