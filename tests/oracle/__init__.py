"""A brute-force GR(1) solver on explicit states: the judge of slugs/ in tests, never fast.

``specification``: formulas, and what a file declares; ``text``: both input languages; ``game``: its
transitions, the textbook fixpoint, and the one strategy that compatibility with SLUGS fixes to the
byte; ``automata``: a model checker of strategies from any program, which shares nothing with the
fixpoint (it judges the judge), and damage to them; ``generator``; ``duel``: a binary against all.
"""
