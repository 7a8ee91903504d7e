"""Catalogues from YAML: robot models and obstacle types.

The built-in one is shipped with the package; a scenario adds to it, or replaces entries, in
place or from a file. Nothing about a model or a type is written in code.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from pathlib import Path

from msgspec.structs import replace

from safenav.scenario.model import (
    Battery,
    Catalogue,
    Need,
    ObstacleType,
    ResolveAt,
    RobotModel,
    Timing,
)
from safenav.scenario.reading.motion import read_motion
from safenav.scenario.reading.naming import NAME
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping as MappingNode
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.source import parsed, read_source
from safenav.world.map import Region
from safenav.world.moves import Mobility

BUILT_IN = "built in"
RESOLVE_WITHIN = "resolve_within"
_FOLDER = Path(__file__).parents[1] / "built_in"

CATALOGUE_KEYS = ("robots", "obstacles")
MODEL_KEYS = (
    "mobility",
    "layer",
    "capabilities",
    "vision",
    "size",
    "speed",
    "timing",
    "motion",
    "battery",
    "carries",
)
TIMING_KEYS = ("least", "most")
MOST_TICKS = 1000
UNLIMITED = "unlimited"
TIMING_REQUIRED = {"most": "the most ticks that a step takes, for example {least: 1, most: 3}"}
MODEL_REQUIRED = {
    "mobility": "'mobility: free' or 'mobility: heading'",
    "layer": "robots of one layer avoid each other, for example 'layer: ground'",
}
TYPE_REQUIRED = {"action": "the capability that resolves it, for example 'action: push'"}
TYPE_KEYS = ("action", "resolve_at", "needs", "blocks", "has_truth", "resolve_within", "sweeps")
BATTERY_KEYS = ("capacity", "move", "stay", "charge", "start")
BATTERY_REQUIRED = {
    "capacity": "the most that it holds, for example 'capacity: 60'",
    "charge": "what a tick on a charger gives, for example 'charge: 5'",
}
MOST_CHARGE = 1_000_000
NEED_KEYS = ("action", "robots", "at", "together", "same")
MOST_ROBOTS = 100
MOST_LOADS = 100


@lru_cache(maxsize=1)
def built_in() -> Catalogue:
    """The catalogue that is shipped with the package."""
    catalogue = Catalogue()
    for name in ("robots.yaml", "obstacles.yaml"):
        path = _FOLDER / name
        findings = Findings(str(path))
        text = read_source(path, findings)
        if text is not None:
            regions = RegionReader(None, {}, findings)
            catalogue = extended(catalogue, text, regions, findings, BUILT_IN)
        findings.raise_if_any()
    return catalogue


def extended(
    base: Catalogue,
    text: str,
    regions: RegionReader,
    findings: Findings,
    source: str,
    team: Collection[str] | None = None,
) -> Catalogue:
    """``base`` extended by the text of a catalogue file, whose ``findings`` these are."""
    document = parsed(text, findings)
    if document is None:
        return base.without_rest()
    return read_catalogue(document.root, base, regions.for_file(findings), findings, source, team)


def read_catalogue(
    node: Node,
    base: Catalogue,
    regions: RegionReader,
    findings: Findings,
    source: str,
    team: Collection[str] | None = None,
) -> Catalogue:
    """``base`` extended by a mapping of ``robots`` and ``obstacles``. ``team``: the names of the
    scenario's robots, which ``blocks`` may list; None without a scenario: any name may be."""
    entries = read.mapping(node, "catalogue", findings, CATALOGUE_KEYS)
    if entries is None:
        return base.without_rest()
    sources = dict(base.sources)
    broken = set(base.broken)
    robots = dict(base.robots)
    listed = read.mapping(entries.get("robots"), "'robots' of catalogue", findings)
    for key, item in listed.entries if listed else ():
        model = _model(key, item, findings)
        if model is None:
            broken.add(key.text)
        else:
            robots[model.name] = model
            sources[f"robots.{model.name}"] = source
    known = replace(base, robots=robots, broken=frozenset(broken))
    obstacles = dict(base.obstacles)
    listed = read.mapping(entries.get("obstacles"), "'obstacles' of catalogue", findings)
    for key, item in listed.entries if listed else ():
        kind = _type(key, item, known, regions, findings, team)
        if kind is None:
            broken.add(key.text)
        else:
            obstacles[kind.name] = kind
            sources[f"obstacles.{kind.name}"] = source
    return Catalogue(robots, obstacles, sources, frozenset(broken))


def _named(key: Scalar, what: str, findings: Findings) -> str | None:
    if NAME.fullmatch(key.text):
        return key.text
    hint = "use letters, digits, '_' and '-', beginning with a letter"
    findings.add(key, f"'{clipped(key.text)}' cannot name {what}", hint)
    return None


def _model(key: Scalar, node: Node, findings: Findings) -> RobotModel | None:
    before = len(findings)
    name = _named(key, "a robot model", findings)
    what = f"robot model {clipped(key.text)}"
    item = read.mapping(node, what, findings, MODEL_KEYS, MODEL_REQUIRED)
    if item is None:
        return None
    mobility = read.choice(item.get("mobility"), f"'mobility' of {what}", Mobility, findings)
    layer = read.text(item.get("layer"), f"'layer' of {what}", findings)
    capabilities = read.words(item.get("capabilities"), f"'capabilities' of {what}", findings)
    vision = read_vision(item.get("vision"), f"'vision' of {what}", findings)
    size, speed = (
        read.positive(item.get(word), f"'{word}' of {what}", findings) for word in ("size", "speed")
    )
    timing = _timing(item.get("timing"), f"'timing' of {what}", findings)
    motion = read_motion(item.get("motion"), item, mobility, what, findings)
    battery = _battery(item.get("battery"), f"'battery' of {what}", findings)
    carries = read.integer(
        item.get("carries"), f"'carries' of {what}", findings, least=1, most=MOST_LOADS
    )
    if len(findings) > before or name is None or mobility is None or layer is None:
        return None
    return RobotModel(
        name,
        mobility,
        layer,
        capabilities or frozenset(),
        vision,
        size,
        speed,
        timing,
        motion,
        battery,
        carries or 1,
    )


def _battery(node: Node | None, what: str, findings: Findings) -> Battery | None:
    """``{capacity: 60, move: 1, stay: 0, charge: 5, start: 60}``."""
    item = read.mapping(node, what, findings, BATTERY_KEYS, BATTERY_REQUIRED)
    if item is None:
        return None
    least = {"capacity": 1, "charge": 1}
    given = {
        key: read.integer(
            item.get(key), f"'{key}' in {what}", findings, least=least.get(key, 0), most=MOST_CHARGE
        )
        for key in BATTERY_KEYS
    }
    capacity, charge, start = given["capacity"], given["charge"], given["start"]
    if capacity is None or charge is None:
        return None
    if start is not None and start > capacity:
        findings.add(item.get("start"), f"'start' in {what} is {start}, and it holds {capacity}")
    move = 1 if given["move"] is None else given["move"]
    if move > capacity:
        findings.add(item.get("move"), f"'move' in {what} is {move}, and it holds {capacity}")
    return Battery(capacity, charge, capacity if start is None else start, move, given["stay"] or 0)


def read_vision(node: Node | None, what: str, findings: Findings) -> float | None:
    """A radius in regions, at least 1; None if nothing is written, or ``unlimited``."""
    if isinstance(node, Scalar) and node.value == UNLIMITED:
        return None
    radius = read.finite(node, what, findings, f"a number of regions, or '{UNLIMITED}'")
    if radius is not None and radius < 1:
        hint = "a robot sees at least the regions next to its own"
        findings.add(node, f"{what} is {radius:g}, and must be at least 1", hint)
        return None
    return radius


def _timing(node: Node | None, what: str, findings: Findings) -> Timing:
    """Ticks that a step takes: ``2``, or ``{least: 1, most: 3}``."""
    if not isinstance(node, MappingNode):
        ticks = read.integer(node, what, findings, least=1, most=MOST_TICKS)
        return Timing() if ticks is None else Timing(ticks, ticks)
    read.mapping(node, what, findings, TIMING_KEYS, TIMING_REQUIRED)
    least, most = (
        read.integer(node.get(word), f"'{word}' in {what}", findings, least=1, most=MOST_TICKS)
        for word in TIMING_KEYS
    )
    if least is not None and most is not None and least > most:
        findings.add(node, f"{what}: at least {least} and at most {most} ticks")
    return Timing(least or 1, most or 1)


def _type(
    key: Scalar,
    node: Node,
    known: Catalogue,
    regions: RegionReader,
    findings: Findings,
    team: Collection[str] | None,
) -> ObstacleType | None:
    before = len(findings)
    name = _named(key, "an obstacle type", findings)
    what = f"obstacle type {clipped(key.text)}"
    listed = isinstance(node, MappingNode) and node.get("needs") is not None
    item = read.mapping(node, what, findings, TYPE_KEYS, {} if listed else TYPE_REQUIRED)
    if item is None:
        return None
    needs = _needs(item.get("needs"), what, regions, findings) if listed else ()
    if listed:
        for word in ("action", "resolve_at"):
            if (stray := item.get(word)) is not None:
                found = f"{what} has both 'needs' and '{word}'"
                findings.add(stray, found, "each need says its own 'action' and 'at'")
        action: str | None = needs[0].action if needs else ""
        where: ResolveAt | frozenset[Region] | None = needs[0].at if needs else None
    else:
        action = read.text(item.get("action"), f"'action' of {what}", findings)
        where = places(item.get("resolve_at"), f"'resolve_at' of {what}", regions, findings)
    blocks = _blocks(item.get("blocks"), what, known, findings, team)
    if needs and needs[-1].same and needs[-1].at is ResolveAt.SELF and blocks != frozenset():
        found = (
            f"the last need of {what} is met inside it by the 'same' robots, which may not enter"
        )
        findings.add(node, found, "say 'at: neighbours', or 'blocks: []'")
    has_truth = read.boolean(item.get("has_truth"), f"'has_truth' of {what}", findings)
    limit = read.integer(item.get(RESOLVE_WITHIN), f"'{RESOLVE_WITHIN}' of {what}", findings)
    sweeps = swept(item.get("sweeps"), what, listed, regions, findings)
    if len(findings) > before or name is None or action is None:
        return None
    where = where or ResolveAt.SELF
    return ObstacleType(name, action, where, blocks, has_truth or False, needs, limit, sweeps)


def _needs(
    node: Node | None, what: str, regions: RegionReader, findings: Findings
) -> tuple[Need, ...]:
    """``needs: [{action: lift, robots: 2, at: neighbours, together: true}]``, in this order."""
    items = read.sequence(node, f"'needs' of {what}", findings) or ()
    if node is not None and not items:
        findings.add(node, f"'needs' of {what} is empty", "say what must be done to resolve it")
    found: list[Need] = []
    for number, entry in enumerate(items, 1):
        label = f"need {number} of {what}"
        item = read.mapping(entry, label, findings, NEED_KEYS, TYPE_REQUIRED)
        if item is None:
            continue
        action = read.text(item.get("action"), f"'action' of {label}", findings)
        same = read.boolean(item.get("same"), f"'same' of {label}", findings) or False
        if same and number == 1:
            findings.add(item.get("same"), f"{label} has no need before it to be the 'same' as")
        before = found[-1].robots if same and found else 1
        robots = read.integer(
            item.get("robots"), f"'robots' of {label}", findings, least=1, most=MOST_ROBOTS
        )
        if same and found and (robots or before) != before:
            said = f"{label} takes {robots} robots, and the need before it {before}"
            findings.add(item.get("robots"), said, "the same robots meet both; leave 'robots' out")
        where = places(item.get("at"), f"'at' of {label}", regions, findings)
        together = read.boolean(item.get("together"), f"'together' of {label}", findings)
        if action is not None:
            where = where or ResolveAt.SELF
            found.append(Need(action, robots or before, where, together or False, same))
    return tuple(found)


def swept(
    node: Node | None, what: str, several: bool, regions: RegionReader, findings: Findings
) -> ResolveAt | frozenset[Region] | None:
    """The regions that a resolution sweeps. ``several``: it takes more than one need."""
    found = places(node, f"'sweeps' of {what}", regions, findings)
    if found is ResolveAt.SELF or (found is not None and several):
        said = "it has several needs" if several else "its own region is meant anyway"
        hint = "'sweeps' lists regions beside an obstacle of one 'action', or is 'neighbours'"
        findings.add(node, f"'sweeps' of {what}: {said}", hint)
    return found


def places(
    node: Node | None, label: str, regions: RegionReader, findings: Findings
) -> ResolveAt | frozenset[Region] | None:
    if not isinstance(node, Sequence):
        return read.choice(node, label, ResolveAt, findings)
    if not node.items:
        findings.add(node, f"{label} is empty", "without a region no robot can resolve it")
        return None
    found = [regions.regions(item, label) or frozenset() for item in node.items]
    return frozenset().union(*found)


def _blocks(
    node: Node | None,
    what: str,
    known: Catalogue,
    findings: Findings,
    team: Collection[str] | None,
) -> frozenset[str] | None:
    label = f"'blocks' of {what}"
    words = {*known.layers, *known.robots, *(team or ())}
    for item in node.items if isinstance(node, Sequence) else ():
        word = item.value if isinstance(item, Scalar) else None
        if not isinstance(word, str) or not word.strip() or known.broken or team is None:
            continue  # not a word at all, or perhaps the layer of a model that is broken
        if word not in words:
            found = f"{label}: '{clipped(word)}' is not a layer, a robot model or a robot"
            findings.add(item, found, suggestion(word, words))
    return read.words(node, label, findings)
