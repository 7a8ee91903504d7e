"""Changes of catalogue entries, as one writes them in a scenario.

An entry of a scenario replaces the built-in one of the same name, so a change of a built-in entry
is written with all its other keys."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from msgspec.structs import replace

from safenav.scenario.model import Need, ObstacleType, ResolveAt, RobotModel
from safenav.scenario.objective import Word, number_word
from safenav.scenario.reading.catalogue import built_in


def model_change(model: RobotModel, **values: str) -> tuple[tuple[str, str], ...]:
    """The items and the values that give a robot model other values of some keys."""
    item = f"catalogue.robots.{model.name}"
    if model != built_in().robots.get(model.name):
        return tuple((f"{item}.{key}", value) for key, value in values.items())
    return ((item, model_written(model, values)),)


def model_written(model: RobotModel, changed: Mapping[str, str] = MappingProxyType({})) -> str:
    """A built-in robot model in YAML, with other values of some keys."""
    keys = {
        "mobility": model.mobility.value,
        "layer": model.layer,
        "capabilities": f"[{', '.join(sorted(model.capabilities))}]",
        "size": None if model.size is None else f"{model.size:g}",
        "speed": None if model.speed is None else f"{model.speed:g}",
        "motion": None if model.motion is None else model.motion.kind,
        **changed,
    }
    return _mapping(keys)


def need_change(
    kind: ObstacleType, number: int, need: Need, word: Word = number_word
) -> tuple[str, str]:
    """The item and the value that give a type another need with this number."""
    item, needs = f"catalogue.obstacles.{kind.name}", list(kind.needs)
    alone = not kind.listed and replace(needs[number], at=need.at) == need
    needs[number] = need
    if kind == built_in().obstacles.get(kind.name) or not (kind.listed or alone):
        return item, type_written(replace(kind, listed=() if alone else tuple(needs)), need, word)
    if alone:
        return f"{item}.resolve_at", _at(need, word)
    return f"{item}.needs", f"[{', '.join(_need(each, word) for each in needs)}]"


def type_written(kind: ObstacleType, first: Need | None = None, word: Word = number_word) -> str:
    """An obstacle type in YAML; ``first``: its only need, if it lists none."""
    blocks = None if kind.blocks is None else f"[{', '.join(sorted(kind.blocks))}]"
    if kind.listed:
        listed = ", ".join(_need(each, word) for each in kind.listed)
        keys: dict[str, str | None] = {"needs": f"[{listed}]", "blocks": blocks}
    else:
        need = first or kind.needs[0]
        keys = {"action": need.action, "resolve_at": _at(need, word), "blocks": blocks}
    keys["has_truth"] = "true" if kind.has_truth else None
    keys["resolve_within"] = None if kind.resolve_within is None else f"{kind.resolve_within}"
    return _mapping(keys)


def _need(need: Need, word: Word) -> str:
    return _mapping(
        {
            "action": need.action,
            "robots": f"{need.robots}" if need.robots > 1 else None,
            "at": _at(need, word),
            "together": "true" if need.together else None,
            "same": "true" if need.same else None,
        }
    )


def _at(need: Need, word: Word) -> str:
    if isinstance(need.at, ResolveAt):
        return need.at.value
    return f"[{', '.join(map(word, sorted(need.at)))}]"


def _mapping(keys: dict[str, str | None]) -> str:
    said = ", ".join(f"{key}: {value}" for key, value in keys.items() if value is not None)
    return f"{{{said}}}"
