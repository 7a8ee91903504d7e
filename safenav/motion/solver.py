"""The solver of quadratic programmes, DAQP."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from safenav.extras import missing

OPTIMAL = 1


def solution(user: str, *programme: NDArray[np.generic]) -> NDArray[np.float64] | None:
    """Return the solution of a quadratic programme: its cost, slope, rows, their upper and lower
    bounds, and perhaps their senses; None if the solver finds none. ``user``: the feature that
    needs it."""
    try:
        import daqp
    except ImportError as error:
        raise missing(user, "daqp", "motion") from error
    found, _, flag, _ = daqp.solve(*programme)
    return np.asarray(found) if flag == OPTIMAL else None
