"""The forms of names that scenarios give to things."""

import re

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""The form of names that become variables of specifications."""
