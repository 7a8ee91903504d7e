"""The second kind of coordination: goals assigned at runtime, without resynthesis."""

import pytest

from once import SCENARIOS
from runtime.played import completed, play
from runtime.test_case_studies import EVENTS


@pytest.mark.parametrize(
    ("number", "new_strategies"), [(1, []), (2, ["digit"]), (3, [])], ids=["door", "scout", "chain"]
)
def test_case_studies_need_new_strategies_only_for_new_walls(
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


def test_requester_waits_and_helper_goes_while_signalled() -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    trace = play(text.replace("until:", "coordination: assignable\nuntil:"))
    asked, done = trace.one("push")["tick"], trace.one("resolved")["tick"]
    assert {trace.position("quad", tick) for tick in range(asked, done + 1)} == {46}
    assert trace.position("digit", done) == 47
