"""Runs of robots with batteries: random ones, and live steps; others are ``cases/energy``."""

import json
import os
from collections.abc import Callable
from functools import partial
from random import Random

import pytest

from drawn import loads
from once import SCENARIOS
from runtime.facts import case
from runtime.played import completed, play
from safenav.errors import InputError, UsageError
from support.boards import walled

COUNT = (int(os.environ.get("SAFENAV_FUZZ", "0")) or 24) // 3


def stop(seed: int, *, once: bool = False) -> str:
    """A robot with a battery, alone on its floor, among rooms with doors that it opens itself."""
    random = Random(seed)
    grid = walled(random, 4, 7, 0.15)
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    random.shuffle(free)
    turns = random.random() < 0.5
    goals = f"once: {free[5:8]}" if once else f"visit: {free[5:7]}"
    battery = f"{{capacity: {random.randint(8, 24)}, charge: {random.choice((1, 4))}, stay: 0}}"
    chargers = free[: random.randint(1, 3)]
    text = [
        "safenav: 1",
        f"map: {{grid: {json.dumps(grid)}}}",
        "catalogue:",
        "  robots:",
        f"    cart: {{mobility: {'heading' if turns else 'free'}, layer: ground,",
        f"           capabilities: [], battery: {battery}}}",
        "robots:",
        f"  cart: {{model: cart, start: {free[4]}, heading: east,",
        f"         objective: {{{goals}}}}}",
        f"chargers: {chargers}",
        "until: {rounds: 3}",
        "limits: {ticks: 600}",
    ]
    return "\n".join(text) + "\n"


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_lone_robot_completes_its_rounds_or_is_refused(
    seed: int, played: Callable[[], None]
) -> None:
    text, _ = loads(partial(stop, once=seed % 3 == 0), seed)
    assert play(text).outcome["outcome"] in ("completed", "unrealizable")
    played()


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
