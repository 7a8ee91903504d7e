"""Changes of catalogue entries, in the notation of scenarios. An entry of a scenario replaces the
built-in one of that name, so a changed built-in entry is written with all its keys."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from msgspec.structs import replace

from safenav.scenario.model import Need, ObstacleType, ResolveAt, RobotModel
from safenav.scenario.objective import Word, number_word
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.yaml.document import flow


def model_change(model: RobotModel, **values: str) -> tuple[tuple[str, str], ...]:
    """Return the items and the values that give a robot model other values of some keys."""
    item = f"catalogue.robots.{model.name}"
    if model != built_in().robots.get(model.name):
        return tuple((f"{item}.{key}", value) for key, value in values.items())
    return ((item, model_written(model, values)),)


def model_written(model: RobotModel, changed: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return a built-in robot model in YAML, with other values of some keys."""
    keys = {
        "mobility": model.mobility.value,
        "layer": model.layer,
        "capabilities": sorted(model.capabilities),
        "size": model.size,
        "speed": model.speed,
        "motion": model.motion and model.motion.kind,
    }
    return flow({**keys, **changed})


def need_change(
    kind: ObstacleType, number: int, need: Need, word: Word = number_word
) -> tuple[str, str]:
    """Return the item and the value that give a type another need with this number."""
    item, needs = f"catalogue.obstacles.{kind.name}", list(kind.needs)
    alone = not kind.listed and replace(needs[number], at=need.at) == need
    needs[number] = need
    if kind == built_in().obstacles.get(kind.name) or not (kind.listed or alone):
        return item, type_written(replace(kind, listed=() if alone else tuple(needs)), need, word)
    if alone:
        return f"{item}.resolve_at", flow(_at(need, word))
    return f"{item}.needs", flow([_need(each, word) for each in needs])


def type_written(kind: ObstacleType, first: Need | None = None, word: Word = number_word) -> str:
    """Return an obstacle type in YAML; ``first``: its only need, if it lists none."""
    need = first or kind.needs[0]
    keys = {"action": need.action, "resolve_at": _at(need, word)}
    if kind.listed:
        keys = {"needs": [_need(each, word) for each in kind.listed]}
    rest = {
        "blocks": None if kind.blocks is None else sorted(kind.blocks),
        "has_truth": kind.has_truth or None,
        "resolve_within": kind.resolve_within,
    }
    return flow({**keys, **rest})


def _need(need: Need, word: Word) -> dict[str, object]:
    return {
        "action": need.action,
        "robots": need.robots if need.robots > 1 else None,
        "at": _at(need, word),
        "together": need.together or None,
        "same": need.same or None,
    }


def _at(need: Need, word: Word) -> object:
    return need.at.value if isinstance(need.at, ResolveAt) else [*map(word, sorted(need.at))]
