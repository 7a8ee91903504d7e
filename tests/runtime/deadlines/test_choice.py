"""Acts under deadlines whose search runs out of budget; others are ``cases/deadlines``."""

import pytest

from runtime.facts import case
from runtime.played import play
from safenav.runtime.deadlines import schedule

PARCELS = case("deadlines/slower_robot_in_time")


def test_without_a_budget_the_nearest_robot_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "BUDGET", 0)
    played = play(PARCELS)
    assert all(line["spent"] for line in played.all("acts"))
    assert played.outcome["late"] == ["parcel@23"]


def test_an_exhausted_budget_keeps_the_acts_found_for_the_most_urgent_obstacle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(schedule, "BUDGET", 1)  # enough for one parcel, not for two
    played = play(PARCELS)
    both = played.all("acts")[1]
    assert (both["spent"], both["beyond"]) == (True, ["parcel@17"])
    assert [act["obstacle"] for act in both["acts"]] == ["parcel@23"]
    assert played.outcome["late"] == []
