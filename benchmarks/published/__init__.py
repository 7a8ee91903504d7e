"""Families of specifications that others published, rewritten at every size.

Reactive synthesizers are compared on these.  Each function gives structuredslugs text.
"""

from published.arbiters import amba, genbuf, synt15
from published.robots import belief, bunny

__all__ = ["amba", "belief", "bunny", "genbuf", "synt15"]
