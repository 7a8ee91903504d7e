"""Formulas keep their memory in the rest of a run."""

import json

import pytest
from msgspec.structs import replace

from runtime.played import Run, begin, completed, loaded, play
from runtime.resuming.cuts import FORMULAS, REMEMBERS, begun
from safenav import Mission
from safenav.audit.check import audit
from safenav.runtime.analysis.resuming import resumed
from safenav.scenario.settings import Clock
from safenav.trace.reading import read_lines


@pytest.mark.parametrize("name", FORMULAS)
def test_the_rest_of_a_run_keeps_the_memory_of_formulas(name: str, clock: str) -> None:
    """What they do at each moment of the run, as the audit derives it, too."""
    scenario = loaded(REMEMBERS % tuple(map(json.dumps, FORMULAS[name])))
    mission, run = begin(replace(scenario, clock=Clock(clock)))
    for _ in range(24):
        mission.step()
        if mission.result is not None:
            break
        first, begins = read_lines(run.lines), Run()
        rest = resumed(first, mission.scenario)
        remembered = dict(mission.state.robots["r"].memory.values)
        assert begun(rest).robots["r"].memory == remembered, mission.state.tick
        Mission(rest, listeners=[begins]).start()
        assert audit(read_lines(begins.lines), first).findings == ()
        told = begins.records[0]["scenario"]["begun"]["robots"]["r"]
        told["memory"] = {key: int(not value) for key, value in told["memory"].items()}
        wrong = audit(read_lines(begins.lines), first).findings
        known = clock == "lockstep" and name != "input"  # else another one fits, too
        assert not known or any("memory" in one.explanation for one in wrong)


def test_the_rest_does_not_revisit_a_region_that_its_memory_contains() -> None:
    """The robot may enter 7 only after 6; cut on its way back, it goes straight there."""
    scenario = loaded(REMEMBERS % tuple(map(json.dumps, FORMULAS["flag"])))
    first = play(scenario).upto("move", **{"from": 6})
    rest = completed(resumed(read_lines(first), scenario))
    assert 6 not in rest.path("r")


ONE_FLAG = """
map: {{grid: ["#########", "#.......#", "#########"]}}
robots:
  a:
    model: quadcopter
    start: [1, 1]
    objective:
      ltl: {{memory: {{{name}: bool}}, safety: {name}' <-> ({name} | region = 15),
             liveness: {name} & region = 10}}
clock: {clock}
"""


@pytest.mark.parametrize("name", ["seen", "went"])
def test_memory_of_other_formulas_is_not_continued(name: str, clock: str) -> None:
    """Their memory has other variables than that of the run before."""
    whole = play(loaded(ONE_FLAG.format(name="seen", clock=clock)))
    changed = loaded(ONE_FLAG.format(name=name, clock=clock))
    resume = resumed(read_lines(whole.upto("goal")), changed)
    assert ("a" in begun(resume).robots) is (name == "seen")
    completed(resume)
