"""Random missions in all ways, judged by an independent exhaustive search.

``support.missions`` makes them by family and seed; ``judge`` reads them again by code that shares
nothing with safenav, and says whether they can be completed; ``play`` plays one and compares.
``python -m campaigns --family tight mixed --seeds 0:500`` (in ``tests/``) is a campaign.
"""
