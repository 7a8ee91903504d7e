"""The kinds of motion by name, each in a module that is loaded when a robot moves so."""

from __future__ import annotations

from importlib import import_module

from safenav.errors import UsageError
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Mover
from safenav.scenario.motion import installed_kind, known_kinds, parameters

_BUILT_IN = {
    "walker": ("safenav.motion.walker.mover", "WalkerMover"),
    "flyer": ("safenav.motion.flyer.mover", "FlyerMover"),
    "rover": ("safenav.motion.rover", "RoverMover"),
    "disc": ("safenav.motion.disc", "DiscMover"),
}


def mover(
    robot: str, floor: MetricFloor, region: int, heading: str | None, motion: dict[str, object]
) -> Mover:
    """The mover of a robot whose ``motion`` (kind and parameters) stands in a trace.

    Raises UsageError for an unknown kind, a missing or impossible parameter.
    """
    kind = str(motion.get("kind"))
    known = parameters(kind)
    if known is None:
        raise UsageError(
            f"{robot}: unknown kind of motion '{kind[:40]}'\n    known: {', '.join(known_kinds())}"
        )
    values = {name: parameter.default for name, parameter in known.items()}
    for name, parameter in known.items():
        value = motion.get(name, parameter.default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(f"{robot}: '{name}' of its motion is not a number")
        if not parameter.least <= value <= parameter.most:
            limits = f"from {parameter.least:g} to {parameter.most:g}"
            raise UsageError(f"{robot}: '{name}' of its motion is {value:g}, not {limits}")
        values[name] = float(value)
    found = _class(kind)
    size = values.get("size", 0.5)
    made = found(robot, floor, region, heading, size, values)
    made.shape(motion.get("footprint"))
    return made


def _class(kind: str) -> type[Mover]:
    if kind in _BUILT_IN:
        module, name = _BUILT_IN[kind]
        found = getattr(import_module(module), name)
    else:
        found = installed_kind(kind)
    assert isinstance(found, type) and issubclass(found, Mover), f"{kind} is not a Mover"
    return found
