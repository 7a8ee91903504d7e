"""Orders of a program, and in other worlds; others are ``cases/orders``."""

from typing import Any

import pytest

from runtime.played import begin, completed, end
from runtime.worlds import Driven
from safenav.errors import UsageError
from safenav.runtime.intervention.kinds import PlaceOrder

CATALOGUE = {
    "robots": {
        "cart": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
        "eye": {"mobility": "free", "layer": "air", "capabilities": ["look"]},
    },
    "obstacles": {
        "parcel": {"action": "lift", "blocks": []},
        "photo": {"action": "look", "blocks": []},
    },
}


PLAN = {
    "safenav": 1,
    "clock": "lockstep",
    "map": {"grid": [".....", "....."]},
    "catalogue": CATALOGUE,
    "robots": {
        "ann": {"model": "cart", "start": 0, "objective": {"visit": [0, 5]}},
        "bob": {"model": "eye", "start": 4, "objective": {"hold": 4}},
    },
    "orders": [{"at": 3, "type": "parcel", "region": 9}],
    "until": {"rounds": 1},
}


def test_a_program_orders_during_a_run() -> None:
    mission, run = begin(PLAN)
    mission.step()
    kinds = mission.scenario.catalogue.obstacles
    for kind, region, said in (
        ("door", 9, "a door stops robots"),
        ("parcel", 10, "region 10 is off the map"),
    ):
        with pytest.raises((UsageError, IndexError), match=said):
            mission.intervene(PlaceOrder(kinds[kind], region))
    mission.intervene(PlaceOrder(kinds["photo"], 0))
    mission.intervene(PlaceOrder(kinds["photo"], 0))
    end(mission, run)
    who = {x["obstacle"]: x["robot"] for x in run.all("resolved")}
    assert who == {"photo@0": "bob", "photo@0#2": "bob", "parcel@9": "ann"}


def test_an_order_of_a_live_run_has_the_time_at_which_it_is_placed() -> None:
    """Not at the second whose number is that of the pass."""
    mission, run = begin(PLAN | {"clock": "live", "orders": [], "until": {"rounds": 12}})
    for _ in range(40):
        mission.step()
    made = mission._run.state.time
    assert made < mission.tick / 2
    mission.intervene(PlaceOrder(mission.scenario.catalogue.obstacles["parcel"], 9))
    end(mission, run)
    assert made <= run.one("order")["t"] <= made + 5


class Outside(Driven):
    """A world of a user: no simulation, it does what it is told."""

    def act(self, robot: Any) -> Any:
        self.truth.changes(10**6, ())  # what is ordered is there
        return super().act(robot)


def test_orders_reach_the_team_in_another_world() -> None:
    assert completed(PLAN, world=Outside).all("order")
