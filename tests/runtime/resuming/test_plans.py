"""A joint plan continues in the rest of a run."""

import pytest
from msgspec.structs import replace
from safenav.runtime.analysis.resuming import resumed

from once import SCENARIOS
from runtime.played import completed, loaded, play
from runtime.resuming.cuts import begun, continued, with_another
from safenav.audit.check import audit
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.trace.reading import read_lines


@pytest.mark.slow
def test_a_joint_plan_is_followed_to_its_end(clock: str) -> None:
    """Wherever the run is cut: it takes no more ticks than the run that is not cut."""
    scenario = replace(load_scenario(SCENARIOS / "two_digits.yaml"), clock=Clock(clock))
    whole = play(scenario)
    lines = whole.lines
    ends = range(len(whole.upto("plan")), len(whole.upto("plan_end")) - 3, 7)
    for cut in ends:  # before the last arrival
        first = read_lines(lines[:cut])
        resume = resumed(first, scenario)
        plan = begun(resume).plan
        assert plan is not None
        assert begun(with_another(resume)).plan is None
        rest = completed(resume)
        left = {name: [list(at) for at in way] for name, way in plan.robots.items()}
        assert rest.one("plan")["robots"] == left
        if clock == "lockstep":
            before = whole.records[cut - 1]["tick"]
            assert rest.outcome["ticks"] + before <= whole.outcome["ticks"] + 1
        assert audit(read_lines(rest.lines), first).findings == ()
        header = rest.records[0]["scenario"]["begun"]
        header["plan"]["robots"]["left"].insert(1, header["plan"]["robots"]["left"][0])
        problems = audit(read_lines(rest.lines), first).findings
        assert problems[0].explanation.startswith("joint plan of left: ")
        header["plan"] = None
        problems = audit(read_lines(rest.lines), first).findings
        assert problems[0].explanation == "joint plan: none; in the first run: present"


def test_a_joint_plan_that_a_rest_has_not_begun_again(clock: str) -> None:
    """A rest that is cut before its first step hands the plan on as it was, and to no team with
    another robot."""
    scenario = replace(load_scenario(SCENARIOS / "two_digits.yaml"), clock=Clock(clock))
    whole = play(scenario)
    rest = continued(whole, len(whole.upto("plan")) + 8, scenario)
    second = read_lines(rest.upto("plan")[:-1])
    resume = resumed(second, scenario)
    for team in (resume, with_another(resume)):
        assert audit(read_lines(play(team).lines), second).findings == ()
    run = play(resume)
    run.records[0]["scenario"]["begun"]["plan"]["orders"].clear()
    problems = audit(read_lines(run.lines), second).findings
    assert problems[0].explanation.startswith("orders of the joint plan: none; in the first run: ")


CORRIDOR = """
map: {{grid: ["#########", "#{free}.###..#", "#.......#", "#..###..#", "#########"]}}
catalogue:
  robots:
    cart: {{mobility: free, layer: ground, capabilities: []}}
robots:
  a: {{model: cart, start: [2, 1], objective: {{visit: [[2, 7], [2, 1]]}}}}
  b: {{model: cart, start: [2, 7], objective: {{visit: [[2, 1], [2, 7]]}}}}
{more}
clock: {clock}
"""


WEST = "never_together: [{robots: [a, b], in: [[2, 1], [2, 2], [1, 1], [1, 2], [3, 1], [3, 2]]}]"


@pytest.mark.parametrize("change", [{"free": "#"}, {"more": WEST}], ids=["a wall", "apart"])
def test_a_joint_plan_of_another_scenario_is_not_followed(
    change: dict[str, str], clock: str
) -> None:
    """Where its steps are no longer possible, or robots are to keep apart in other regions."""
    plain = {"free": ".", "more": "", "clock": clock}
    whole = play(loaded(CORRIDOR.format(**plain)))
    cut = len(whole.upto("plan")) + 5
    changed = loaded(CORRIDOR.format(**plain | change))
    resume = resumed(read_lines(whole.lines[:cut]), changed)
    assert begun(resume).plan is not None
    completed(resume)
