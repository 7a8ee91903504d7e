"""Random examples of properties: bounded among the tests, or as many as the user sets.

``SAFENAV_FUZZ=5000`` tries 5000 new random examples of each property, instead of a few fixed ones.
"""

import os

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

CHARACTERS = st.characters(exclude_categories=["Cs"])
"""Those of `st.text()`, which finds them by encoding each: for 2 s in each process."""


def campaign(bounded: int) -> settings:
    """Settings for a property that tries ``bounded`` examples in a bounded campaign."""
    wanted = os.environ.get("SAFENAV_FUZZ")
    return settings(
        max_examples=int(wanted) if wanted else bounded,
        derandomize=not wanted,
        deadline=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )
