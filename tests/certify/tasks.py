"""A robot's task as a bundle with only a header and one synthesis.

The specification may be altered before it is synthesized, as an error in the compiler would.
"""

import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from safenav.certify.bundle import files_of_run
from safenav.errors import Verdict
from safenav.files import json_line
from safenav.judge.bundle.evidence import Evidence
from safenav.judge.engine import judge
from safenav.runtime.control.strategies import Controller
from safenav.runtime.run.lines import synthesis_line
from safenav.scenario.model import Clock, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.belief import automatic
from safenav.spec.compile import compile_task
from safenav.spec.specification import Specification
from safenav.spec.task import NO_MEMORY, Known, Memory, ObjectiveForm, Observed, Task
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records
from safenav.trace.file import as_data
from safenav.trace.vocabulary import Reason
from safenav.verify.verification import first_failure
from safenav.world.map import Partition

Planted = Callable[[Specification], Specification]

CATALOGUE = """\
catalogue:
  robots:
    rover: {mobility: free, layer: ground, capabilities: []}
    walker: {mobility: heading, layer: ground, capabilities: []}
"""


def scenario_of(grid: str, robots: str, more: str = "", models: str = "") -> Scenario:
    """A scenario from a drawn map and its robots as YAML; ``models``: further ones."""
    text = (
        "safenav: 1\nname: a task\nmap:\n  grid: |\n"
        + textwrap.indent(textwrap.dedent(grid).strip("\n"), "    ")
        + "\n"
        + CATALOGUE
        + models
        + "robots:\n"
        + textwrap.indent(textwrap.dedent(robots).strip("\n"), "  ")
        + "\n"
        + more
    )
    return load_scenario_text(text, "task.yaml", reachable=False)


@dataclass(frozen=True)
class Circumstances:
    """What the first robot of a scenario is synthesized under, beyond the scenario."""

    closed: tuple[int, ...] = ()
    memory: Memory = NO_MEMORY


ORDINARY = Circumstances()


def task_of(scenario: Scenario, about: Circumstances = ORDINARY) -> Task:
    """The task of the first robot at the start."""
    robot = scenario.robots[0]
    observed = tuple(
        Observed(other.name, other.start.region)
        for other in scenario.robots[1:]
        if other.name in robot.tracks
    )
    names = {o.region: o.name for o in scenario.obstacles}
    return Task(
        robot=robot,
        pose=robot.start,
        objective=robot.objective,
        memory=about.memory,
        blocked=tuple(Known(r, names[r], "it is there") for r in about.closed),
        observed=observed,
        inputs=tuple((each, False) for each in scenario.inputs),
        partition=None if scenario.partition is None else Partition(scenario.partition),
        live=scenario.clock is Clock.LIVE,
    )


def verdict_of(
    scenario: Scenario,
    target: Path,
    about: Circumstances = ORDINARY,
    planted: Planted = lambda spec: spec,
) -> str:
    """Why the checker refuses the first robot's controller, '' if it accepts it."""
    task = task_of(scenario, about)
    spec = planted(compile_task(task, scenario.map))
    synthesizer = Synthesizer(cache=Cache(target / "cache"), verifier=first_failure)
    answer = synthesizer.synthesize(spec)
    t = 0.0 if task.live else None
    listed = scenario.partition or automatic(scenario.map).cells
    cells = tuple(tuple(sorted(cell)) for cell in listed)
    lines: list[records.Record] = [
        records.Header(0, records.VERSION, "test", scenario.recorded, cells=cells)
    ]
    if about.closed:  # met before
        name, at = task.robot.name, task.pose.region
        lines += [
            records.Violation(0, name, at, o.region, o.name, o.type.action)
            for o in scenario.obstacles
        ]
    form = ObjectiveForm(task.objective, about.memory.index)
    found = Controller(task, task.objective, form, answer)
    line = synthesis_line(0, Reason.INITIAL, found, scenario.map)
    node = None if answer.strategy is None else 0
    lines.append(replace(line, t=t, node=node))
    trace = "".join(json_line(as_data(each)) for each in lines).encode()
    files = files_of_run(trace, {}, synthesizer)
    for name, data in files.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_bytes(data)
    evidence = Evidence({name: target / name for name in files})
    judged = judge(trace.splitlines(keepends=True), evidence.rules())  # it is not a run
    if judged.findings:
        return judged.findings[0].explanation
    claims = [claim["kind"] for claim in evidence.claims]
    wanted = "keeps" if answer.verdict is Verdict.REALIZABLE else "unrealizable"
    return "" if wanted in claims else f"nothing was established: {claims}"
