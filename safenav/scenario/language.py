"""The scenario language: a class for each mapping of a file, an annotated field for each key.

``scenario.yaml.typed`` reads the classes; ``keys`` writes their JSON Schema. Classes of the model
(``scenario.model``) are read directly; the modules of ``reading`` turn the other classes into them.
``values`` contains the forms of values. docs/scenario.md explains each key.
"""

from typing import Annotated, Any, ClassVar, Literal

from safenav.scenario import model, values
from safenav.scenario.objective import EXAMPLE, KINDS, kinds_that
from safenav.scenario.yaml.document import Scalar, one_of
from safenav.scenario.yaml.keys import Beside, Item, Key, OneOf, entries, key, name_key, version
from safenav.strict_json import MOST_NUMBER

VERSION = 1

Model = Annotated[model.RobotModel, Key(form=str, by="model")]
Type = Annotated[model.ObstacleType, Key(form=str, by="type")]
Task = Annotated[model.ObstacleType, Key(form=str, by="task")]
Together = Annotated[model.Exclusion, Key(form=model.Exclusion, by="exclusion")]
_CLOSED = "is reserved for regions that robots report as closed"
TypeName = Annotated[
    Scalar, name_key("an obstacle type", prefixes=model.FAILURES, reserved=_CLOSED)
]


class TileKeys(Item, frozen=True):
    """Cells of equal size."""

    tiles: tuple[Annotated[int, Key(least=1)], Annotated[int, Key(least=1)]] | None = key(
        "Rows and columns of a tile.", "for example {tiles: [4, 4]}", expected="[rows, columns]"
    )


FORMS = ("grid", "image", "ros", "movingai")
"""The forms of a map."""
_OF_FILES = "only files are divided: in a grid each character is a region"
_COUNTED = "a ROS map is divided by 'resolution: 0.5'; in a grid each character is a region"
_GRID = "'grid: |' and below it one indented line of '#' and '.' for each row"
_DRAWN = f"write {_GRID}, or name a file: 'image', 'ros' or 'movingai'"


class MapKeys(Item, frozen=True):
    """The known world: one of grid, image, ros and movingai (docs/maps.md)."""

    example: ClassVar = f"{_GRID}; or 'image: map.png'"
    rules: ClassVar = (
        OneOf(FORMS, _DRAWN, "a map has one form"),
        Beside("share", FORMS[1:], _OF_FILES),
        *(Beside(word, ("image", "movingai"), _COUNTED) for word in ("rows", "cols")),
        Beside("image", ("rows",)),
        Beside("ros", ("resolution",)),
        Beside("origin", ("grid", "image", "movingai"), "leave it out: the file has its own"),
        Beside("rows", ("cols",), "give both or none"),
        Beside("cols", ("rows",), "give both or none"),
        Beside(
            "origin", ("resolution",), "also write 'resolution', the side of a region in metres"
        ),
    )
    elsewhere: ClassVar = {"areas": "'areas' belongs beside 'map', not in it"}
    grid: values.GridRows | None = key("One line for each row: '#' is a wall, '.' is free.")
    image: Scalar | None = key("A PNG or PGM file: dark is wall.")
    ros: Scalar | None = key("The YAML file of a map as ROS map_server saves it.")
    movingai: Scalar | None = key("A map of the MovingAI benchmarks.")
    rows: int | None = key(
        "Number of rows into which an image or a MovingAI map is divided.", least=1
    )
    cols: int | None = key(
        "Number of columns into which an image or a MovingAI map is divided.", least=1
    )
    share: float | None = key(
        "A region with at least this share blocked is a wall. Default: 0, any.", least=0, most=1
    )
    resolution: float | None = key(
        "Side of a region in metres.", least=values.LEAST_SIDE, most=values.MOST_SIDE
    )
    origin: values.Corner | None = key(
        "[x, y] or [x, y, yaw] of the south-western corner, in metres, radians.",
        expected=values.CORNER,
    )
    names: dict[values.RegionName, values.Position] | None = key(
        "Names for regions.", example="{dock: [3, 8]}"
    )


_WITHIN = key("Maximum number of ticks from the request to the resolution.")


class TypeKeys(Item, frozen=True):
    """A type of obstacles: an action that resolves it, or several needs."""

    one: ClassVar = "obstacle type {name}"
    example: ClassVar = "{action: push}"
    elsewhere: ClassVar = dict.fromkeys(
        ("robots", "together", "same"),
        "it belongs to a need: 'needs: [{action: lift, robots: 2, at: neighbours}]'",
    )
    rules: ClassVar = (
        OneOf(
            ("action", "needs"),
            "the capability that resolves it, for example 'action: push'",
            "each need has its own 'action' and 'at'",
        ),
        Beside("resolve_at", ("action",), "each need has its own 'at'"),
    )
    action: model.Action | None = key("The capability that resolves it.")
    resolve_at: model.Where = model.ResolveAt.SELF
    needs: tuple[model.Need, ...] | None = key(
        "Several actions that resolve it, in this order.",
        entries=1,
        why="list the actions that resolve it",
    )
    blocks: tuple[Scalar, ...] | None = key(
        "Layers, models and robots that it stops, whatever their capabilities. Default: all."
    )
    has_truth: bool = key(
        "Whether resolving it reveals if the region is traversable.", default=False
    )
    resolve_within: int | None = _WITHIN


class CatalogueKeys(Item, frozen=True):
    """Robot models and obstacle types; they replace built-in ones of the same name."""

    robots: dict[values.ModelName, model.RobotModel] | None = key(
        "Robot models by name.", example="{cart: {mobility: free, layer: ground}}"
    )
    obstacles: dict[TypeName, TypeKeys] | None = key(
        "Obstacle types by name.", example="{fire_door: {action: push}}"
    )


class LtlKeys(Item, frozen=True):
    """Guarantees in structured slugs over region, heading and memory."""

    label: ClassVar = "in {what}"
    example: ClassVar = "{liveness: [region = 14, region = 20], safety: region' != 47}"
    rules: ClassVar = (
        OneOf(
            ("safety", "liveness"),
            "give it 'liveness' (what to reach infinitely often) or 'safety' (always)",
        ),
    )
    init: values.FormulaList | None = key("Conditions at the start (no next values).")
    safety: values.FormulaList | None = key("Conditions on every step.")
    liveness: values.FormulaList | None = key("Conditions met infinitely often.")
    memory: dict[values.Variable, values.Range] | None = key(
        "Memory variables: bool or [lowest, highest].", example="{done: bool, laps: [0, 3]}"
    )


FORM, WITHIN, RULES = "form", "within", ("avoid", "always")
TIMED = kinds_that(lambda kind: kind.timed())
STRICT = kinds_that(lambda kind: kind.strict)


def _kind(name: str) -> Any:
    """Return the key of an objective of this kind."""
    kind = KINDS[name]
    about = f"{kind.meaning[0].upper()}{kind.meaning[1:]}."
    if kind.one:
        return key(about)
    return key(about, entries=1, why="name at least one target", schema={"minItems": kind.least})


class ObjectiveKeys(Item, frozen=True):
    """The task of a robot, repeated in rounds."""

    one: ClassVar = "objective {rest} when {name}"
    label: ClassVar = "{rest}"
    example: ClassVar = EXAMPLE
    elsewhere: ClassVar = dict.fromkeys(
        ("rounds", "repeat", "times", "until"), "write 'until: {rounds: 3}' beside 'robots'"
    ) | {
        "ltl": f"only the 'objective' of a robot has formulas: use {one_of(kinds_that())}",
        **dict.fromkeys(
            ("when", "while_waiting", "tracks", "avoids", "vision", "heading", "start"),
            "it belongs to the robot, beside 'objective'",
        ),
    }
    rules: ClassVar = (
        OneOf((*KINDS, "ltl"), f"give it one, for example {EXAMPLE}", "choose one of them"),
        Beside(FORM, STRICT, "leave it out: other kinds have one form only"),
        Beside(WITHIN, TIMED, "rounds of other kinds cannot have a deadline"),
    )
    patrol: tuple[values.TargetValue, ...] | None = _kind("patrol")
    visit: tuple[values.TargetValue, ...] | None = _kind("visit")
    cover: tuple[values.TargetValue, ...] | None = _kind("cover")
    hold: values.TargetValue | None = _kind("hold")
    once: tuple[values.TargetValue, ...] | None = _kind("once")
    ltl: LtlKeys | None = None
    form: Literal["literal"] | None = key(
        "literal: the exact formula, or unrealizable.", why="leave it out to accept a weaker form"
    )
    within: int | None = key(f"Maximum number of ticks of each round of {one_of(TIMED)}.", least=1)
    avoid: values.ZoneValue | None = key("Regions that the robot never enters.")
    always: values.FormulaList | None = key(
        "Formulas over region and heading that each of its steps satisfies."
    )


OtherObjective = Annotated[ObjectiveKeys, Key(without=("ltl",))]
_IN_OBJECTIVE = {
    word: f"it belongs in the objective: 'objective: {{{word}: ...}}'"
    for word in entries(ObjectiveKeys)
}


class RobotKeys(Item, frozen=True):
    """A robot of the team."""

    one: ClassVar = "robot {name}"
    label: ClassVar = "of {rest}"
    example: ClassVar = f"{{model: quadcopter, start: 47, objective: {EXAMPLE}}}"
    elsewhere: ClassVar = _IN_OBJECTIVE | {
        word: f"it belongs to a model: 'catalogue: {{robots: {{mine: {{{word}: ...}}}}}}'"
        for word in entries(model.RobotModel)
        if word != "vision"
    }
    model_: Model | None = key("A robot model of the catalogue.", "for example 'model: digit'")
    start: values.RegionValue | None = key(
        "Its initial region.", "a region, for example 'start: 47' or 'start: [3, 8]'"
    )
    heading: Literal["north", "east", "south", "west"] | None = key(
        "Its initial heading, for mobility heading."
    )
    objective: ObjectiveKeys | None = key("", f"its task, for example 'objective: {EXAMPLE}'")
    while_waiting: OtherObjective | None = key(
        "Its objective while it waits for help; not 'ltl'. Default: it stays."
    )
    vision: values.Vision = None
    avoids: tuple[model.KnownRobot, ...] | None = key(
        "Robots whose regions it must not enter. Default: those of its layer."
    )
    tracks: tuple[model.KnownRobot, ...] = key(
        "Robots whose positions its specification models by beliefs.", default=()
    )
    when: dict[values.InputOn, OtherObjective] | None = key(
        "Other objectives while inputs are on; the first input that is on counts.",
        example=f"{{alarm: {EXAMPLE}}}",
    )


_AT = "for example 'region: 47' or 'region: [3, 8]'"


class ObstacleKeys(Item, frozen=True):
    """A hidden obstacle."""

    one: ClassVar = "an obstacle"
    label: ClassVar = "of {type}"
    example: ClassVar = "{type: door, region: 47}"
    type: Type | None = key("An obstacle type of the catalogue.", "for example 'type: door'")
    region: values.RegionValue | None = key("Its region.", _AT)
    traversable: bool | None = key(
        "The truth that resolving it reveals, if its type has one. Default: true."
    )
    from_: int | None = key(
        "The tick from which it appears, as soon as no robot is there. Default: 1.", least=1
    )
    until: int | None = key(
        "The tick at which it disappears, even if it is not resolved. Default: never.", least=1
    )
    resolve_within: int | None = _WITHIN


class OrderKeys(Item, frozen=True):
    """A task that the team receives during the run."""

    one: ClassVar = "an order"
    example: ClassVar = "{at: 10, type: parcel, region: 47}"
    at_: int | None = key(
        "The tick at which the team receives it.", "for example 'at: 10'", least=1
    )
    type: Task | None = key(
        "An obstacle type with 'blocks: []'.", "an obstacle type with 'blocks: []'"
    )
    region: values.RegionValue | None = key("Its region.", _AT)
    resolve_within: int | None = _WITHIN


class ChangeKeys(Item, frozen=True):
    """Another objective of a robot, or its service."""

    one: ClassVar = "a change of {robot}"
    label: ClassVar = "of {robot}"
    example: ClassVar = "{at: 12, robot: quad, service: out}"
    elsewhere: ClassVar = _IN_OBJECTIVE
    rules: ClassVar = (
        OneOf(
            ("objective", "service"),
            "give it an 'objective', or 'service: out' or 'service: back'",
            "give each a change of its own",
        ),
    )
    at_: int | None = key("The tick at which it applies.", "for example 'at: 12'", least=1)
    robot: model.KnownRobot | None = key(
        "The name of a robot of the team.", "the name of a robot of the team"
    )
    objective: OtherObjective | None = key(
        "Its objective from then on; not 'ltl'. None for robots with 'when'."
    )
    service: Literal["out", "back"] | None = key("out: it stops; back: it continues.")


class ScenarioKeys(Item, frozen=True):
    """A map, robots with objectives, and hidden obstacles (format version 1). See
    docs/scenario.md."""

    label: ClassVar = ""
    title: ClassVar = "safenav scenario"
    example: ClassVar = "the file that 'safenav new FILE' writes"
    elsewhere: ClassVar = dict.fromkeys(entries(MapKeys), "it belongs in 'map': indent it") | {
        "failures": "write it in the fleet file of 'safenav drive'; runs have fixed defaults",
        "max_ticks": "write 'limits: {ticks: ...}'",
        **{
            word: f"it belongs in '{name}': '{name}: {{{word}: ...}}'"
            for name, part in (("until", model.Until), ("limits", model.Limits))
            for word in entries(part)
        },
    }
    safenav: int | None = version(VERSION, "scenario", "safenav")
    name: str | None = key("Its name in reports. Default: that of the file.")
    map: MapKeys | None = key(
        "", "draw it: 'map:', below it 'grid: |', below that rows of '#' and '.'"
    )
    areas: dict[values.AreaName, values.AreaValue] | None = key(
        "Named sets of regions, usable as targets.", example="{lab: [[1, 1], [1, 2]]}"
    )
    robots: dict[values.RobotName, RobotKeys] | None = key(
        "The team by name, in the order of moves within a tick.",
        "name each robot with its model, start and objective",
        example=f"{{quad: {RobotKeys.example}}}",
        schema={"minProperties": 1, "maxProperties": 1000},
    )
    never_together: tuple[Together, ...] = key(
        "Sets of regions that at most one of the listed robots may occupy at a time.", default=()
    )
    inputs: dict[values.InputName, model.Input] | None = key(
        "Booleans that the environment sets.", example="{alarm: {at: 12-30}}"
    )
    obstacles: tuple[ObstacleKeys, ...] = key(
        "Hidden obstacles, which robots discover by encountering them.", default=()
    )
    orders: tuple[OrderKeys, ...] = key("Tasks that the team receives during the run.", default=())
    changes: tuple[ChangeKeys, ...] = key(
        "Changes of robots' objectives or service during the run.", default=()
    )
    until: model.Until = model.Until()
    limits: model.Limits = model.Limits()
    clock: model.Clock = key(
        "lockstep: time passes in ticks; live: in seconds.", default=model.Clock.LOCKSTEP
    )
    resolve_within: int | None = key(
        "Maximum ticks from a request to its resolution, unless the obstacle has its own."
    )
    late: model.LatePolicy = key(
        "After a missed deadline: go_on or stop.", default=model.LatePolicy.GO_ON
    )
    chargers: tuple[values.Regions, ...] = key("Regions where batteries are charged.", default=())
    flat: Task | None = key(
        "The obstacle type (with 'blocks: []') that represents a robot without charge."
    )
    seed: int = key("Seed of all random draws.", most=MOST_NUMBER, default=0)
    coordination: model.Coordination = key(
        "Method of reassignment: resynthesis or assignable.", default=model.Coordination.RESYNTHESIS
    )
    partition: Literal["rooms"] | TileKeys | None = key(
        "The cells of beliefs: rooms, or {tiles: [rows, columns]}. Default: rooms.",
        expected="'rooms' or {tiles: [rows, columns]}",
    )
    requirements: values.Requirements | None = key(
        "Formulas over the motion, such as always(distance(a, b) >= 1); they may have names."
    )
    expect: model.Expect | None = None
    catalogue: CatalogueKeys | str | None = key(
        "Robot models and obstacle types, inline or as the path of a file.",
        expected="a mapping (key: value), or the path of a file",
    )
