"""A battery that is delivered in a live run, and a fraction of charge; others: ``cases/energy``."""

import pytest

from once import SCENARIOS
from runtime.facts import case
from runtime.played import completed, play
from safenav.errors import UsageError


def test_the_robot_that_fetches_a_battery_in_a_live_run_swaps_it() -> None:
    text = (SCENARIOS / "battery_delivery.yaml").read_text()
    played = completed(text.replace("clock: lockstep", "clock: live"))
    assert len({line["robot"] for line in (*played.all("met"), played.one("resolved"))}) == 1


def test_a_robot_may_not_use_a_fraction_of_charge_per_tick() -> None:
    with pytest.raises(UsageError, match=r"'stay: 0\.2' of cart is a charge per second"):
        play(case("energy/charge_per_second").replace("clock: live\n", ""))
