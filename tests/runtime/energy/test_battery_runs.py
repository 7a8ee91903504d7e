"""Live steps of robots with batteries; others are ``cases/energy``."""

import pytest

from once import SCENARIOS
from runtime.facts import case
from runtime.played import completed, play
from safenav.errors import InputError, UsageError


def test_a_live_step_takes_the_same_charge_at_any_speed() -> None:
    live = case("energy/by_the_second_charger") + "clock: live\n"
    faster = live.replace("capabilities: [],\n", "capabilities: [], speed: 2, motion: disc,\n", 1)
    assert faster != live
    one, other = (
        [line["to"] for line in completed(text).all("depart", robot="cart")]
        for text in (live, faster)
    )
    assert one == other


def test_the_robot_that_fetches_a_battery_in_a_live_run_swaps_it() -> None:
    text = (SCENARIOS / "battery_delivery.yaml").read_text()
    played = completed(text.replace("clock: lockstep", "clock: live"))
    assert len({line["robot"] for line in (*played.all("met"), played.one("resolved"))}) == 1


FRACTION = """
name: charge per second
map: {grid: ["########", "#......#", "########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [], size: 0.5, speed: 1,
           battery: {capacity: 30, stay: 0.2, charge: 5}}
robots: {cart: {model: cart, start: [1, 2], objective: {visit: [[1, 6], [1, 2]]}}}
obstacles: [{type: door, region: [1, 4], until: 100}]
chargers: [[1, 1]]
until: {rounds: 3}
"""


def test_a_robot_may_use_a_fraction_of_charge_per_second_but_not_per_tick() -> None:
    """It waits for the door at the charger, before its charge is used up; the audit agrees."""
    run = completed(f"{FRACTION}clock: live\n")
    assert run.all("arrive", at=9) and run.one("gone")
    with pytest.raises(UsageError, match=r"'stay: 0\.2' of cart is a charge per second"):
        play(FRACTION)
    with pytest.raises(InputError, match="expected a number with at most six decimals"):
        play(FRACTION.replace("0.2", "0.1234567"))
