"""The number of ticks after which a robot without progress counts as starving."""

import pytest

from runtime.played import play

CORRIDOR = """
map: {grid: ["########", "#......#", "###.####", "########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground}
    kite: {mobility: free, layer: LAYER, timing: 6}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 6], [1, 1]]}}
  b: {model: cart, start: [1, 6], objective: {visit: [[1, 1], [1, 6]]}}
  k: {model: kite, start: [2, 3], objective: {hold: [2, 3]}}
until: {rounds: 1}
"""


@pytest.mark.parametrize(("layer", "patience"), [("air", 5), ("ground", 20)])
def test_only_robots_that_may_be_waited_for_make_others_patient(layer: str, patience: int) -> None:
    """The carts meet in tick 2; a kite that takes 6 ticks for a step is above them, or among
    them."""
    run = play(CORRIDOR.replace("LAYER", layer))
    assert run.all("plan")[0]["tick"] == 2 + patience
