"""Random missions through the real command line, judged by an independent exhaustive search.

``generate`` makes missions by family and seed; ``judge`` reads them again by code that shares
nothing with safenav, and says whether they can be completed; ``verdict`` plays one and compares.
``python -m campaigns --family tight --seeds 0:500`` (in ``tests/``) is a campaign.
"""
