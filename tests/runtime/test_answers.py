"""Answers that come during a look-up, and searches that end without one: no world makes them."""

from typing import Any

import pytest

from runtime.facts import case
from runtime.played import loaded, play
from runtime.worlds import Faulty
from safenav import Synthesizer
from safenav.plan import search
from safenav.runtime.control.answers import Answers
from safenav.solve import solve


def test_a_result_that_arrives_while_it_is_looked_up_is_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looks = iter([False, *[True] * 9])
    monkeypatch.setattr(Answers, "ready", property(lambda _: next(looks)))
    answers = Answers(Synthesizer())
    answers._awaited = True
    assert [answers.fresh(), answers.fresh(), answers.fresh()] == [False, True, False]


def test_an_exhausted_search_budget_names_the_robot_out_of_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only an operator brings the robot back, whatever plan another search would find."""
    plan = Answers.plan

    def spent(answers: Answers, floor: Any, *about: Any, **how: Any) -> Any:
        return plan(answers, floor, *about, **how) if 0 in floor.robots else None

    monkeypatch.setattr(Answers, "plan", spent)
    ring = case("failures/ring")
    outcome = play(ring, world=Faulty(loaded(ring), [["a", 1, "fatal"]]), lies=True).outcome
    assert (outcome["outcome"], outcome["cause"]) == ("operator_needed", "out_of_service")
    assert outcome["explanation"].startswith("a (its steps fail) is out of service; search budget")


@pytest.mark.parametrize(
    "budgets", [((search, "PROOF"), (search, "SINGLES")), ((solve, "MOST_NODES"),)]
)
def test_a_search_that_exceeds_its_budget_is_not_a_verdict(
    budgets: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module, budget in budgets:
        monkeypatch.setattr(module, budget, 1)
    text = case("objectives/once_with_a_trapped_helper")
    gone = text.replace("region: 10}", "region: 10, until: 20}")
    assert [play(each).outcome["outcome"] for each in (text, gone)] == ["search_limit", "completed"]


def test_an_expensive_request_does_not_end_a_mission_that_does_not_need_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for budget in ("PROOF", "SINGLES"):
        monkeypatch.setattr(search, budget, 1)
    assert play(case("requests/set_aside")).outcome["outcome"] == "completed"
