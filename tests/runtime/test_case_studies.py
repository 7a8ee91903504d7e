"""The paper's three case studies, by resynthesis, by assignable goals and with limited sight: their
events in order."""

import pytest

from once import SCENARIOS
from runtime.played import Run, completed, play

EVENTS = ("violation", "request", "push", "resolved", "blocked", "pop", "outcome")


def events(trace: Run) -> str:
    """What happened: the types of its records, each with the region of its obstacle."""
    told = ((kind, (obstacle or "").rpartition("@")[2]) for kind, obstacle in trace.order(*EVENTS))
    return " ".join(kind + region for kind, region in told)


def test_digit_opens_the_door_that_the_quadcopter_meets() -> None:
    trace = completed((SCENARIOS / "case_study_1.yaml").read_text())
    assert events(trace) == "violation47 request47 push47 resolved47 pop47 outcome"
    violation = trace.one("violation")
    assert (violation["robot"], violation["at"], violation["proposed"]) == ("quad", 46, 47)
    push = trace.one("push")
    assert push["objectives"]["quad"] == {"hold": 46}
    assert push["objectives"]["digit"] == {"visit": [47, 58]}
    resolved = trace.one("resolved")
    assert (resolved["robot"], resolved["at"], resolved["requested"]) == ("digit", 47, True)
    waiting = range(violation["tick"], resolved["tick"] + 1)
    assert {trace.position("quad", tick) for tick in waiting} == {46}
    assert trace.one("pop")["objectives"] == {
        "quad": {"patrol": [54, 49]},
        "digit": {"patrol": [58, 28]},
    }
    assert 49 in trace.path("quad")[resolved["tick"] :]


def test_quadcopter_scouts_both_gaps_for_digit() -> None:
    trace = completed((SCENARIOS / "case_study_2.yaml").read_text())
    assert events(trace) == (
        "violation34 request34 push34 resolved34 blocked34 pop34 "
        "violation60 request60 push60 resolved60 pop60 outcome"
    )
    assert [(v["at"], v["proposed"]) for v in trace.all("violation")] == [(33, 34), (59, 60)]
    assert [r["traversable"] for r in trace.all("resolved")] == [False, True]
    assert trace.one("blocked")["robots"] == ["digit"]
    assert 34 not in trace.path("digit")
    assert 60 in trace.path("digit")


def test_helper_needs_help_itself() -> None:
    trace = completed((SCENARIOS / "case_study_3.yaml").read_text())
    assert events(trace) == (
        "violation43 request43 push43 violation47 request47 push47 "
        "resolved47 pop47 resolved43 pop43 outcome"
    )
    first, second = trace.all("violation")
    assert (first["robot"], first["at"]) == ("digit", 44)
    assert (second["robot"], second["at"]) == ("quad", 48)
    assert [p["depth"] for p in trace.all("push")] == [1, 2]
    assert trace.all("push")[1]["objectives"] == {
        "quad": {"hold": 48},
        "digit": {"visit": [47, 44]},
    }
    assert trace.all("pop")[0]["objectives"]["digit"] == {"hold": 44}
    sensed = trace.all("resolved")[1]
    assert sensed["robot"] == "quad"
    assert sensed["at"] in (42, 44)


@pytest.mark.parametrize("name", ["hello", "case_study_1", "case_study_2", "case_study_3"])
def test_every_strategy_is_verified_and_the_same_run_repeats(name: str) -> None:
    text = (SCENARIOS / f"{name}.yaml").read_text()
    trace = play(text)
    assert {s["verified"] for s in trace.all("synthesis")} == {True}
    again = play(text)
    assert again.all("move") == trace.all("move")
    assert {s["cached"] for s in again.all("synthesis")} == {True}


@pytest.mark.parametrize(
    ("number", "new_strategies"), [(1, []), (2, ["digit"]), (3, [])], ids=["door", "scout", "chain"]
)
def test_assignable_goals_need_new_strategies_only_for_new_walls(
    number: int, new_strategies: list[str]
) -> None:
    text = (SCENARIOS / f"case_study_{number}.yaml").read_text()
    usual = play(text)
    trace = completed(text.replace("until:", "coordination: assignable\nuntil:"))
    after_start = [s["robot"] for s in trace.all("synthesis") if s["tick"] > 0]
    assert after_start == new_strategies
    assert trace.order(*EVENTS) == usual.order(*EVENTS)
    for key in ("robot", "at", "proposed"):
        assert [v[key] for v in trace.all("violation")] == [v[key] for v in usual.all("violation")]


def test_case_study_3_with_a_digit_that_sees_four_regions() -> None:
    """The paper's own belief tracking: nothing depends on where the quadcopter is, so the
    robots do what they do without it."""
    text = (SCENARIOS / "case_study_3.yaml").read_text()
    usual = play(text)
    told = "digit: {model: digit, vision: 4, tracks: [quad],"
    trace = completed(text.replace("digit: {model: digit,", told))
    kinds = ("violation", "request", "push", "resolved", "pop")
    assert trace.order(*kinds) == usual.order(*kinds)
    beliefs = trace.all("belief", robot="digit", of="quad")
    assert any(b["seen"] for b in beliefs) and not all(b["seen"] for b in beliefs)
    assert not usual.all("belief")
