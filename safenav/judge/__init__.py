"""The judge: does a run obey its scenario, and is what its trace says about its end true?

It shares no code with the programs that it judges, and needs only Python's library. ``engine``
reads the lines (``lines``), lets each of the rules (``rules``, ``ends``) look at a line and the
``state`` before it, and then lets the line take effect. ``proofs`` checks negatives.
"""
