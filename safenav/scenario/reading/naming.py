"""The form of names that scenarios give to regions, areas, models and types."""

import re

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
