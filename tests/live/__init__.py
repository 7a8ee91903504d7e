"""Missions in continuous time: an independent world with faults, and a judge that reads only its
log.

``floor`` is the world, with plain data in and out, so that it may run behind a socket; ``judge``
reads its log; ``campaign`` plays random missions. They share no code with
safenav's simulation and audit.
"""
