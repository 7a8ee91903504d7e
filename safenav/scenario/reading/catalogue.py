"""Catalogues from YAML: robot models and obstacle types.

The built-in catalogue is shipped with the package; a scenario adds to it, or replaces entries, in
place or from a file. Code contains no model and no type.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import ClassVar, TypeVar

from msgspec.structs import replace

from safenav.scenario.model import (
    FAILURES,
    OPERATOR_ACTION,
    Battery,
    Catalogue,
    Need,
    ObstacleType,
    ResolveAt,
    RobotModel,
)
from safenav.scenario.reading.motion import MOTION, read_motion
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.fields import NAME, well_named
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import Key, Shape, Table
from safenav.scenario.yaml.source import parsed, read_source
from safenav.world.map import Region
from safenav.world.moves import Mobility

Entry = TypeVar("Entry", RobotModel, ObstacleType)

BUILT_IN = "built in"
LIBRARY = Path(__file__).parents[1] / "built_in"

MOST_TICKS = 1000
UNLIMITED = "unlimited"
MOST_CHARGE = 1_000_000
MOST_ROBOTS = 100
LISTED = "'safenav catalogue' lists them; 'catalogue' in the scenario adds others"
ACTION = "for example 'action: push'"


def _vision(node: Node | None, what: str, findings: Findings) -> float | None:
    """Return a radius in regions, at least 1; None if it is missing, reported or ``unlimited``."""
    if isinstance(node, Scalar) and node.value == UNLIMITED:
        return None
    radius = read.finite(node, what, findings, f"a number of regions, or '{UNLIMITED}'")
    if radius is not None and radius < 1:
        hint = "a robot sees at least the regions next to its own"
        findings.add(node, f"{what} is {radius:g}, and must be at least 1", hint)
        return None
    return radius


def _amount(node: Node | None, what: str, findings: Findings) -> float | None:
    """Return a charge of at most six decimals."""
    if isinstance(node, Scalar) and isinstance(node.value, int):
        return read.integer(node, what, findings, most=MOST_CHARGE)
    value = read.finite(node, what, findings)
    if value is not None and (not 0 <= value <= MOST_CHARGE or value != round(value, 6)):
        limits = f"from 0 to {MOST_CHARGE}, with at most six decimals"
        findings.add(node, f"{what} is {value:g}, expected a number {limits}")
        return None
    return value


AMOUNT = Shape({"type": "number", "minimum": 0, "maximum": MOST_CHARGE}, _amount)


class BatteryKeys(Table):
    about = "Charge, in units of your choice."
    definition = "battery"
    made = Battery
    capacity = Key(
        shapes.whole(1, MOST_CHARGE), "Full charge.", required="for example 'capacity: 60'"
    )
    move = Key(shapes.whole(0, MOST_CHARGE), "Charge used by a step.")
    stay = Key(AMOUNT, "Charge used by a tick without a step; live, per second, a fraction too.")
    charge = Key(
        shapes.whole(1, MOST_CHARGE),
        "Charge gained by a tick on a charger.",
        required="for example 'charge: 5'",
    )
    start = Key(shapes.whole(0, MOST_CHARGE), "Initial charge. Default: full.")


def _battery(node: Node | None, what: str, findings: Findings) -> Battery | None:
    """``{capacity: 60, move: 1, stay: 0, charge: 5, start: 60}``."""
    item = BatteryKeys.read(node, what, findings, f"in {what}")
    if item is None:
        return None
    found = item.over(Battery(MOST_CHARGE, MOST_CHARGE, -1))
    if item.capacity is None or item.charge is None:
        return None
    for taken, given in ((BatteryKeys.start, found.start), (BatteryKeys.move, found.move)):
        if given > found.capacity:
            message = f"'{taken.name}' in {what} is {given}, and it holds {found.capacity}"
            findings.add(item.where(taken), message)
    return replace(found, start=found.capacity) if found.start < 0 else found


def _places(
    node: Node | None, label: str, reading: Reading
) -> ResolveAt | frozenset[Region] | None:
    """Return resolution regions from a word or a list of regions."""
    if isinstance(node, Scalar) and node.value in {**reading.names, **reading.areas}:
        shown = clipped(node.text)
        message = f"{label}: found the name '{shown}', expected a list of regions"
        reading.add(node, message, f"put brackets around it: [{shown}]")
        return None
    if not isinstance(node, Sequence):
        return read.choice(node, label, reading, shapes.by_word(ResolveAt))
    if not node.items:
        reading.add(node, f"{label} is empty", "without a region no robot can resolve it")
        return None
    found = [reading.regions(item, label) or frozenset() for item in node.items]
    return frozenset().union(*found)


def entry_of(kind: str, entries: Callable[[Catalogue], Mapping[str, Entry]]) -> Shape[Entry]:
    """Return the shape of an entry of the catalogue, written as its name."""

    def reads(node: Node | None, what: str, reading: Reading) -> Entry | None:
        name, known = read.text(node, what, reading), entries(reading.catalogue)
        if name is not None and name not in known and not reading.catalogue.may_hold(name):
            reading.unknown(node, f"{what}: unknown {kind}", name, known, LISTED)
        return known.get(name or "")

    return Shape(shapes.TEXT, reads)


def _action(node: Node | None, what: str, findings: Findings) -> str | None:
    """An action of robots: any word but that of the operator's."""
    found = read.text(node, what, findings)
    if found == OPERATOR_ACTION:
        findings.add(node, f"{what}: '{found}' is reserved for human operators", "use another word")
    return found


def _actions(node: Node | None, what: str, findings: Findings) -> frozenset[str] | None:
    found = read.words(node, what, findings)
    for item in node.items if isinstance(node, Sequence) else ():
        if isinstance(item, Scalar) and item.value == OPERATOR_ACTION:
            _action(item, what, findings)
    return found


ACTION_WORD = Shape(
    {"type": "string", "pattern": "\\S", "not": {"const": OPERATOR_ACTION}}, _action, "action"
)
TYPE_NAME = {**shapes.matching(NAME), "not": {"pattern": f"^({'|'.join(FAILURES)})"}}
MODEL = entry_of("robot model", lambda catalogue: catalogue.robots)
TYPE = entry_of("obstacle type", lambda catalogue: catalogue.obstacles)
VISION = Shape(
    shapes.either({"type": "number", "minimum": 1}, {"const": UNLIMITED}),
    _vision,
    "vision",
    "Radius of sight in regions.",
)
WHERE = Shape(shapes.either({"enum": tuple(ResolveAt)}, shapes.many(REGION, 1)), _places)


class ModelKeys(Table):
    definition = "model"
    made = RobotModel
    mobility = Key(
        shapes.choice(Mobility),
        "free: any neighbour; heading: straight on or with a turn.",
        required="'mobility: free' or 'mobility: heading'",
    )
    layer = Key(
        shapes.TEXT, "Robots of one layer avoid each other.", required="for example 'layer: ground'"
    )
    capabilities = Key(Shape(shapes.many(ACTION_WORD), _actions), "Actions that it can perform.")
    vision = Key(VISION)
    size = Key(shapes.POSITIVE, "Diameter of its body's bounding circle, in metres.")
    speed = Key(shapes.POSITIVE, "Metres per second.")
    timing = Key(shapes.whole(1, MOST_TICKS), "Ticks of a step in lockstep.")
    motion = Key(MOTION)
    battery = Key(Shape(BatteryKeys, _battery))


class NeedKeys(Table):
    definition = "need"
    made = Need
    action = Key(ACTION_WORD, "The capability that resolves it.", required=ACTION)
    robots = Key(shapes.whole(1, MOST_ROBOTS), "Number of distinct robots that perform it.")
    at = Key(WHERE, "Where the action works.")
    together = Key(shapes.TRUTH, "Whether all perform it in the same tick.")
    same = Key(
        shapes.TRUTH, "Whether the robots that fulfilled the previous need must fulfil this one."
    )


class TypeKeys(Table):
    definition = "obstacleType"
    made = ObstacleType
    rules: ClassVar = {
        "oneOf": (
            {"required": ["action"], "not": {"required": ["needs"]}},
            {
                "required": ["needs"],
                "not": shapes.either({"required": ["action"]}, {"required": ["resolve_at"]}),
            },
        )
    }
    action = Key(ACTION_WORD, "The capability that resolves it.")
    resolve_at = Key(WHERE, "Where the action works.")
    needs = Key(
        shapes.form(shapes.many(NeedKeys, 1)), "Several actions that resolve it, in this order."
    )
    blocks = Key(
        shapes.WORDS, "Layers, models and robots that it stops. Default: all without the action."
    )
    has_truth = Key(shapes.TRUTH, "Whether resolving it reveals if the region is traversable.")
    resolve_within = Key(
        shapes.whole(), "Maximum number of ticks from the request to the resolution."
    )


class CatalogueKeys(Table):
    about = "Robot models and obstacle types; they replace built-in ones of the same name."
    definition = "catalogue"
    robots = Key(
        shapes.form(shapes.named(ModelKeys, shapes.matching(NAME))), "Robot models by name."
    )
    obstacles = Key(shapes.form(shapes.named(TypeKeys, TYPE_NAME)), "Obstacle types by name.")


@lru_cache(maxsize=1)
def built_in() -> Catalogue:
    """Return the catalogue that is shipped with the package."""
    catalogue = Catalogue()
    for name in ("robots.yaml", "obstacles.yaml"):
        reading = Reading(str(LIBRARY / name))
        reading.catalogue = catalogue
        read_catalogue_file(LIBRARY / name, reading, BUILT_IN)
        reading.raise_if_any()
        catalogue = reading.catalogue
    return catalogue


def read_catalogue_file(
    path: Path, reading: Reading, source: str, named_at: Node | None = None
) -> None:
    """Add the catalogue in a file to that of ``reading``. ``named_at``: where the file of
    ``reading`` names this one; None if they are the same."""
    inside = reading if named_at is None else reading.beside(str(path))
    text = read_source(path, reading, named_at)
    root = None if text is None else parsed(text, inside)
    if root is not None:
        read_catalogue(root, inside, source)
    reading.catalogue = reading.catalogue.without_rest() if root is None else inside.catalogue


def read_catalogue(node: Node, reading: Reading, source: str) -> None:
    """Add a mapping of ``robots`` and ``obstacles`` to the catalogue of ``reading``."""
    entries = CatalogueKeys.read(node, "catalogue", reading)
    base = reading.catalogue
    if entries is None:
        reading.catalogue = base.without_rest()
        return
    sources, broken = dict(base.sources), set(base.broken)
    robots, obstacles = dict(base.robots), dict(base.obstacles)

    def add(
        node: Node | None, word: str, found: dict[str, Entry], made: Callable[..., Entry | None]
    ) -> None:
        listed = read.mapping(node, f"'{word}' of catalogue", reading)
        for key, item in listed.entries if listed else ():
            if (entry := made(key, item, reading)) is None:
                broken.add(key.text)
            else:
                found[entry.name] = entry
                sources[f"{word}.{entry.name}"] = source

    add(entries.robots, "robots", robots, _model)
    known = replace(base, robots=robots, broken=frozenset(broken))
    add(entries.obstacles, "obstacles", obstacles, partial(_type, known))
    reading.catalogue = Catalogue(robots, obstacles, sources, frozenset(broken))


def _model(key: Scalar, node: Node, findings: Findings) -> RobotModel | None:
    before = len(findings)
    well_named(key, "a robot model", findings)
    what = f"robot model {clipped(key.text)}"
    item = ModelKeys.read(node, what, findings)
    if item is None:
        return None
    given = item.given(*(key for key in item.known.values() if key is not ModelKeys.motion))
    mobility = given.get("mobility")
    given["motion"] = read_motion(item.motion, item.node, mobility, what, findings)
    if len(findings) > before:
        return None
    return RobotModel(**{"name": key.text, "capabilities": frozenset(), **given})


def _type(known: Catalogue, key: Scalar, node: Node, reading: Reading) -> ObstacleType | None:
    before = len(reading)
    if well_named(key, "an obstacle type", reading) and key.text.startswith(FAILURES):
        found = f"'{clipped(key.text)}' is reserved for regions that robots report as closed"
        reading.add(key, found, "use another name")
    what = f"obstacle type {clipped(key.text)}"
    item = TypeKeys.read(node, what, reading)
    if item is None:
        return None
    given = item.given(TypeKeys.has_truth, TypeKeys.resolve_within)
    if item.needs is not None:
        for other in (TypeKeys.action, TypeKeys.resolve_at):
            if (stray := item.where(other)) is not None:
                found = f"{what} has both 'needs' and '{other.name}'"
                reading.add(stray, found, "each need has its own 'action' and 'at'")
        if needs := _needs(item.needs, what, reading):
            given |= {"listed": needs, "action": needs[0].action, "resolve_at": needs[0].at}
    else:
        if item.where(TypeKeys.action) is None:
            reading.add(node, f"{what}: the key 'action' is missing", NeedKeys.action.hint)
        given |= item.given(TypeKeys.action, TypeKeys.resolve_at)
    given["blocks"] = blocks = _blocks(item, what, known, reading)
    last = given["listed"][-1] if "listed" in given else None
    if last and last.same and last.at is ResolveAt.SELF and blocks != frozenset():
        found = f"the 'same' robots fulfil the last need of {what} inside it, but may not enter"
        reading.add(node, found, "say 'at: neighbours', or 'blocks: []'")
    if len(reading) > before or "action" not in given:
        return None
    return ObstacleType(key.text, **given)


def _needs(node: Node | None, what: str, reading: Reading) -> tuple[Need, ...]:
    """Return ``needs: [{action: lift, robots: 2, at: neighbours, together: true}]``, in order."""
    items = read.sequence(node, f"'needs' of {what}", reading) or ()
    if node is not None and not items:
        reading.add(node, f"'needs' of {what} is empty", "list the actions that resolve it")
    found: list[Need] = []
    for number, entry in enumerate(items, 1):
        label = f"need {number} of {what}"
        if (item := NeedKeys.read(entry, label, reading)) is None:
            continue
        given = item.given(NeedKeys.action, NeedKeys.robots, NeedKeys.together, NeedKeys.same)
        same, robots = given.get("same"), given.get("robots")
        if same and number == 1:
            missing = f"{label} has no previous need for 'same'"
            reading.add(item.where(NeedKeys.same), missing)
        before = found[-1].robots if same and found else 1
        if same and found and (robots or before) != before:
            message = f"{label} needs {robots} robots, and the need before it {before}"
            hint = "the same robots fulfil both; leave 'robots' out"
            reading.add(item.where(NeedKeys.robots), message, hint)
        given |= {"robots": robots or before, **item.given(NeedKeys.at)}
        if "action" in given:
            found.append(Need(**given))
    return tuple(found)


def _blocks(of: TypeKeys, what: str, known: Catalogue, reading: Reading) -> frozenset[str] | None:
    node = of.where(TypeKeys.blocks)
    words = {*known.layers, *known.robots, *reading.named}
    for item in node.items if isinstance(node, Sequence) else ():
        word = item.value if isinstance(item, Scalar) else None
        # A separate catalogue may name any robot, and an unreadable model may have any layer.
        checked = reading.robots_known and not (reading.alone or known.broken)
        if not checked or not isinstance(word, str) or not word.strip():
            continue
        if word not in words:
            found = f"'blocks' of {what}: '{clipped(word)}' is not a layer, a robot model or"
            reading.add(item, f"{found} a robot", suggestion(word, words))
    return of.blocks
