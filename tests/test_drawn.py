"""Random tests: a draw that the loader refuses is drawn again."""

import pytest

from drawn import APART, MOST, tried
from safenav.errors import InputError


def accepted_from(seed: int) -> int:
    if seed < 2 * APART:
        raise InputError(())
    return seed


def test_a_refused_draw_is_drawn_again_with_a_seed_that_follows_from_it() -> None:
    assert tried(accepted_from, 7) == (7 + 2 * APART, 2)
    with pytest.raises(AssertionError, match=f"{MOST} draws refused"):
        tried(accepted_from, -MOST * APART)
