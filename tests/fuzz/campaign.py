"""How long the fuzzing goes on: a bounded campaign among the tests, or one as long as wanted.

``SAFENAV_FUZZ=5000`` tries 5000 examples of each property, other ones each time, instead of a
few that are always the same.
"""

import os
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from fuzz.missions import random_mission


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


@st.composite
def scenarios(draw: st.DrawFn, robots: int = 4) -> dict[str, Any]:
    """A random mission, as data, of so many robots at most."""
    mission = random_mission(draw(st.randoms()))
    mission["robots"] = dict([*mission["robots"].items()][:robots])
    return mission | {"deadlock": draw(st.booleans())}
