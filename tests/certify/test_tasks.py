"""Random robots and missions, and errors in the compiler, as the checker of bundles judges them.

A robot's task is a trace of only a header and one synthesis: its controller is accepted, whatever
the verdict, and errors planted in the compiler are caught (``planted.yaml``). The runs of random
missions are certified, whatever their outcome. Exempt is a strategy that exceeds a limit.

Among the tests the campaigns are short; SAFENAV_FUZZ=1000 tries as many others."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from drawn import loads
from explain.games import drawn_scenario
from once import from_yaml
from safenav import (
    Clock,
    Obstacle,
    ResourceLimitError,
    Scenario,
    Specification,
    Synthesizer,
    Task,
    Verdict,
    compile_task,
    first_failure,
    load_scenario_text,
)
from safenav.certify.bundle import bundle_of_run, files_of_run, write_files
from safenav.files import json_line
from safenav.judge.bundle.evidence import Evidence
from safenav.judge.engine import judge
from safenav.runtime.control.strategies import Controller
from safenav.runtime.run.lines import synthesis_line
from safenav.scenario.objective import Patrol, Visit
from safenav.spec.belief import automatic
from safenav.spec.specification import Section
from safenav.spec.task import NO_MEMORY, Known, Memory, ObjectiveForm, Observed
from safenav.synthesis.cache import Cache
from safenav.trace import records
from safenav.trace.file import as_data
from support.missions import mission


def task_of(scenario: Scenario, closed: Sequence[int] = (), awaited: int | None = None) -> Task:
    """The task of the first robot at the start. ``closed``: known obstacles; ``awaited``: the
    target that it remembers."""
    robot = scenario.robots[0]
    names = {o.region: o.name for o in scenario.obstacles}
    return Task(
        robot=robot,
        pose=robot.start,
        objective=robot.objective,
        memory=NO_MEMORY if awaited is None else Memory(awaited),
        blocked=tuple(Known(r, names[r], "it is there") for r in closed),
        observed=tuple(
            Observed(other.name, other.start.region)
            for other in scenario.robots[1:]
            if other.name in robot.tracks
        ),
        partition=scenario.partition,
        closed=frozenset(closed),
        inputs=tuple(
            (each, False) for each in scenario.inputs if each.name in robot.objective.inputs
        ),
        live=scenario.clock is Clock.LIVE,
    )


def refusal(scenario: Scenario, task: Task, spec: Specification, folder: Path) -> str:
    """Why the checker refuses the controller that is synthesized from a specification for a task,
    '' if it accepts it."""
    synthesizer = Synthesizer(cache=Cache(folder / "cache"), verifier=first_failure)
    answer = synthesizer.synthesize(spec)
    listed = scenario.partition or automatic(scenario.map)
    cells = tuple(tuple(sorted(cell)) for cell in listed)
    form = ObjectiveForm(task.objective, task.memory.index)
    line = synthesis_line(0, Controller(task, task.objective, form, answer), scenario.map)
    name, at, closed = task.robot.name, task.pose.region, {each.region for each in task.blocked}
    lines: list[records.Record] = [
        records.Header(0, records.VERSION, "test", scenario.recorded, cells=cells),
        *(  # met before
            records.Violation(0, name, at, o.region, o.name, o.needs[0].action)
            for o in scenario.obstacles
            if o.region in closed
        ),
        *(  # met before: the targets ahead of the awaited one
            records.Goal(0, name, k, min(target), 0)
            for k, target in enumerate(task.robot.objective.targets[: task.memory.index])
        ),
        replace(line, t=0.0 if task.live else None, node=None if answer.strategy is None else 0),
    ]
    trace = "".join(json_line(as_data(each)) for each in lines).encode()
    files = files_of_run(trace, {}, synthesizer)
    write_files(folder, files)
    evidence = Evidence({name: folder / name for name in files})
    judged = judge(trace.splitlines(keepends=True), evidence.rules())  # it is not a run
    if judged.findings:
        return judged.findings[0].explanation
    claims = [claim["kind"] for claim in evidence.claims]
    wanted = "keeps" if answer.verdict is Verdict.REALIZABLE else "unrealizable"
    return "" if wanted in claims else f"nothing was established: {claims}"


PLANTED = from_yaml(Path(__file__).with_name("planted.yaml").read_text())
ACCEPTED = set[str]()
"""Tasks whose strategy is accepted without an error."""


def planted(spec: Specification, what: dict[str, Any]) -> Specification:
    """The specification with an error."""
    if more := what.get("more"):
        section, formula = more
        extra = replace(spec.constraints[0], section=Section(section), formula=formula, regions=())
        return replace(spec, constraints=(*spec.constraints, extra))
    wanted = [c for c in spec.constraints if what.get("section") in (None, c.section.value)]
    if parts := what.get("without"):
        return spec.without([c for c in wanted if any(part in c.formula for part in parts)])
    after = spec.constraints
    for old, new in what.get("exchange", {}).items():
        after = tuple(
            replace(c, formula=c.formula.replace(old, new)) if before in wanted else c
            for before, c in zip(spec.constraints, after, strict=True)
        )
    return replace(spec, constraints=after)


@pytest.mark.parametrize("name", PLANTED["errors"])
def test_a_specification_with_a_planted_error_is_refused(name: str, tmp_path: Path) -> None:
    error = PLANTED["errors"][name]
    data = {"safenav": 1, "robots": error["robots"], "catalogue": PLANTED["catalogue"]}
    data["map"] = {"grid": PLANTED["grids"][error.get("grid", "open")].split()}
    text = json.dumps(data | error.get("more", {}))
    scenario = load_scenario_text(text, "task.yaml", reachable=False)
    task, what = task_of(scenario, **error.get("about", {})), error["planted"]
    spec = compile_task(task, scenario.map)
    if (right := spec.to_structuredslugs()) not in ACCEPTED:
        assert refusal(scenario, task, spec, tmp_path / "right") == ""
        ACCEPTED.add(right)
    wrong = planted(
        compile_task(replace(task, live=what.get("live", task.live)), scenario.map), what
    )
    assert wrong.to_structuredslugs() != right
    assert error["reason"] in refusal(scenario, task, wrong, tmp_path / "wrong")


ROBOTS, MISSIONS = (int(os.environ.get("SAFENAV_FUZZ", few)) for few in ("40", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "5000")) if "SAFENAV_FUZZ" in os.environ else 0


@pytest.mark.parametrize("seed", range(FIRST, FIRST + ROBOTS))
def test_the_controller_of_a_random_robot_is_accepted(
    seed: int, tmp_path: Path, played: Callable[[], None]
) -> None:
    source = Random(seed)
    scenario = drawn_scenario(source)
    objective, taken = scenario.robots[0].objective, scenario.robots[0].start.region
    in_turn = isinstance(objective, Patrol | Visit)
    awaited = source.randrange(len(objective.targets)) if in_turn else None
    hidden = source.choice([region for region in scenario.map.free if region != taken])
    door = Obstacle(scenario.catalogue.obstacles["door"], hidden)
    scenario = replace(scenario, obstacles=(door,))
    task = task_of(scenario, [hidden] if source.random() < 0.4 else [], awaited)
    try:
        assert refusal(scenario, task, compile_task(task, scenario.map), tmp_path) == ""
    except ResourceLimitError as limit:  # a strategy may be too large for the checker
        pytest.skip(str(limit))
    played()


MADE: dict[str, tuple[str, dict[str, str]]] = {
    "lockstep": ("mixed", {}),
    "live": ("mixed", {"clock": "live"}),
    "tracking": ("tracked", {}),
}


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + MISSIONS))
def test_the_run_of_a_random_mission_is_certified(
    seed: int, made: str, tmp_path: Path, played: Callable[[], None]
) -> None:
    family, more = MADE[made]
    data, _ = loads(lambda number: mission(family, number) | more, seed)
    scenario = tmp_path / "mission.yaml"
    scenario.write_text(json.dumps(data | {"coordination": "resynthesis"}))
    try:
        assert bundle_of_run(scenario.read_text(), scenario, tmp_path / "bundle").verdict.accepted
    except ResourceLimitError as limit:  # by beliefs on a large map: no verdict
        pytest.skip(str(limit))
    played()
