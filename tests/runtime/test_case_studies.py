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


STUDIES = {
    "case_study_1": (
        "violation47 request47 push47 resolved47 pop47 outcome",
        [{"quad": {"hold": 46}, "digit": {"visit": [47, 58]}}],
        [{"quad": {"patrol": [54, 49]}, "digit": {"patrol": [58, 28]}}],
    ),
    "case_study_2": (
        "violation34 request34 push34 resolved34 blocked34 pop34 "
        "violation60 request60 push60 resolved60 pop60 outcome",
        [{"digit": {"hold": 33}}, {"digit": {"hold": 59}}],
        [],
    ),
    "case_study_3": (
        "violation43 request43 push43 violation47 request47 push47 "
        "resolved47 pop47 resolved43 pop43 outcome",
        [{"digit": {"hold": 44}}, {"quad": {"hold": 48}, "digit": {"visit": [47, 44]}}],
        [{"digit": {"hold": 44}}],
    ),
}
"""By study: its events, and objectives after each push and after the first pops."""


@pytest.mark.parametrize("name", STUDIES)
def test_the_studies_of_the_paper_have_its_events(name: str) -> None:
    told, pushes, pops = STUDIES[name]
    trace = completed((SCENARIOS / f"{name}.yaml").read_text())
    assert events(trace) == told
    for objectives, line in [
        *zip(pushes, trace.all("push"), strict=True),
        *zip(pops, trace.all("pop"), strict=False),
    ]:
        assert objectives.items() <= line["objectives"].items()
    last = trace.all("violation")[-1]
    (end,) = trace.all("resolved", obstacle=last["obstacle"])
    waits = range(last["tick"], end["tick"])
    assert {trace.position(last["robot"], tick) for tick in waits} == {last["at"]}


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
