"""The judge, which decides whether a run obeys its scenario and whether its trace states the end
truthfully.

It shares only ``strict_json`` with the programs that it judges, and needs only Python's library.
``engine`` reads the lines (``lines``), applies the rules (``rules``, ``changes``, ``ends``) to each
line and the ``state`` before it, and then updates the state. ``proofs`` checks proofs.
"""
