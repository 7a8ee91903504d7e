"""One-sentence reason for unrealizability, which check, synth and run print immediately."""

from __future__ import annotations

from safenav.explain.diagnosis import diagnose
from safenav.explain.explanation import Diagnosis, NoStrategyCause
from safenav.scenario.model import Robot
from safenav.scenario.objective import Ltl, describe
from safenav.spec.forms import asked_of
from safenav.spec.task import Task
from safenav.trace.words import some
from safenav.world.map import RegionMap


def explain_unrealizable(robot: Robot, task: Task, world: RegionMap) -> str:
    """Return one sentence on why ``robot`` cannot fulfil ``task``, as far as the map proves it."""
    why = why_words(diagnose(task, world), task, world)
    return f"{robot.name} cannot {describe(asked_of(task), world.word)}: {why}"


def _closed_words(found: Diagnosis, world: RegionMap) -> str:
    """Return in words the regions that culprits close, grouped by reason."""
    by_reason: dict[str, list[str]] = {}
    for known in found.culprits:
        by_reason.setdefault(known.reason, []).append(world.label(known.region))
    said = []
    for reason, regions in by_reason.items():
        if len(regions) > 1 and reason.endswith(" it"):
            reason = f"{reason.removesuffix('it')}them"
        said.append(f"{some(regions)} {'is' if len(regions) == 1 else 'are'} closed ({reason})")
    return ", ".join(said)


def why_words(found: Diagnosis, task: Task, world: RegionMap) -> str:
    """Return the reason alone."""
    here = world.label(task.pose.region)
    lost = " and ".join(world.labels(target) for target in found.lost)
    things = _closed_words(found, world)
    match found.cause:
        case NoStrategyCause.NO_WAY:
            return f"there is no path from {here} to {lost}: walls are between them"
        case NoStrategyCause.OBSTACLE:
            way = f"from {here} to {lost}" if lost else "to its targets"
            return f"there is no path {way}: {things}"
        case NoStrategyCause.HEADING:
            facing = "" if task.pose.heading is None else f" facing {task.pose.heading.label}"
            return f"from {here}{facing} it cannot reach its targets: it cannot turn on the spot"
        case NoStrategyCause.CROSSING:
            what = world.labels(found.crossing) if found.crossing else "a target"
            return (
                f"'form: literal' forbids crossing {what} out of turn, and there is no other path; "
                "without it, crossing is allowed"
            )
        case NoStrategyCause.FORBIDDEN_WAY:
            return "its 'always' rules leave no path"
        case NoStrategyCause.ONE_WAY:
            if found.lost:
                return f"its mobility allows no path from {here} to {lost}"
            if task.assignable and task.objective.settles:
                last = world.labels(task.objective.targets[-1])
                return (
                    f"with 'coordination: assignable' it must be able to leave {last} again; "
                    "with 'resynthesis' it may end there"
                )
            return "its mobility allows it to enter a region on the path, but not to leave it"
    if isinstance(task.objective, Ltl):
        inputs = " or ".join(task.objective.inputs)
        could = f", or the input {inputs} can keep it from its goals" if inputs else ""
        return f"its guarantees conflict{could}"
    others = ", ".join(task.avoids)
    if others:
        return f"{others} could keep it away forever, or corner it"
    return "its guarantees conflict"
