"""The only reader of the judge: a trace (docs/trace.md) as lines with typed fields. It checks all
data before a rule reads them: JSON without repeated keys, names and sizes (``strict_json``), the
fields of each type of line with their words, and that robots and obstacles are known. It drops
lines and fields that only explain.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from safenav.judge.formulas import HEADINGS, Formulas, UnreadError
from safenav.strict_json import flaws, note_flaw, read_json

VERSION = 4
PASSING = ("tick", "t", "seconds", "cached")
"""Fields of a synthesis that do not describe its task; the others are its ``text``."""
MOST_BYTES = 10_000_000
"""Maximum bytes of a line."""


class NotATraceError(ValueError):
    """Lines that are not a trace. The message states the place and the reason."""


class Line:
    """A line, or a part of one. A missing field is None; ``start`` is the field ``from``."""

    kind: str
    robot: str
    tick: int
    t: float | None
    number: int
    step: Any = None

    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        return None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Line) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]


class Objective(Line):
    """An objective. ``targets``: the regions of each target, none for formulas; ``formulas``:
    formulas of ``ltl`` and ``always``, or None; ``texts``: the formulas of ``ltl`` in words.
    ``settles``: whether the robot stays at its ``last`` target, where each tick is a round;
    ``ends``: whether it does so after meeting each target once; ``strict``: whether it leaves
    targets immediately and touches none out of turn; ``ordered``: whether one target is next."""

    targets: list[frozenset[int]]

    def __init__(self, kind: str, **fields: Any) -> None:
        super().__init__(kind=kind, **fields)
        self.ends, self.strict = kind == "once", kind == "patrol"
        self.settles = self.ends or kind == "hold"
        self.in_turn = self.strict or self.ends or kind == "visit"
        self.ordered = self.in_turn or self.settles

    def __eq__(self, other: object) -> bool:
        keys = ("kind", "data", "literal")
        return all(getattr(self, key) == getattr(other, key, None) for key in keys)

    @property
    def last(self) -> frozenset[int]:
        return self.targets[-1]

    def serves(self, own: Objective) -> bool:
        """Return whether this objective has the goals of ``own``, since it is equal or a weaker
        form."""
        alternate = self.in_turn and own.in_turn and not (self.settles or own.settles)
        return (self.kind == own.kind or alternate) and self.data == own.data


class WrongError(Exception):
    """A value of the wrong type for its field."""


def _require(holds: object, problem: str) -> None:
    if not holds:
        raise WrongError(problem)


Fields = list[tuple[str, bool, str]]  # name, whether the field may be absent, type


def _fields(text: str) -> Fields:
    """Return the fields that ``text`` declares. A field is ``name`` or ``name?`` (optional),
    followed by ``:type`` unless it is a string."""
    words = (word.partition(":") for word in text.split())
    return [(name.rstrip("?"), name.endswith("?"), kind or "str") for name, _, kind in words]


def read(kind: str, value: Any) -> Any:
    """Return a value, checked and converted to the type ``kind``: one of the tables below, one of
    several words (``a|b``), or, for a type ``x``, a list (``x*``; ``x+``: not empty), a set
    (``x!``) or a mapping from names (``x~``)."""
    if kind in VALUES:
        types, least = VALUES[kind]
        if type(value) not in types or (least is not None and value < least):
            names = " or ".join(one.__name__ for one in types)
            raise WrongError(f"must be {names}" + f" of at least {least}" * (least is not None))
        return value
    if kind in MADE:
        return MADE[kind](value)
    if kind in OBJECTS:
        return read_object(OBJECTS[kind], value)
    if kind in TUPLES:
        kinds = TUPLES[kind]
        whole = isinstance(value, list) and len(value) == len(kinds)
        _require(whole, f"must be a list of {len(kinds)} items")
        return tuple(map(read, kinds, value))
    end, inner = kind[-1], kind[:-1]
    if end == "~":
        _require(isinstance(value, dict), "must be an object")
        return {name: read(inner, one) for name, one in value.items()}
    if end in "*+!":
        _require(isinstance(value, list), "must be a list")
        _require(value or end != "+", "must not be empty")
        return (frozenset if end == "!" else tuple)([read(inner, one) for one in value])
    words = (*HEADINGS, None) if kind == "heading" else kind.split("|")
    if value not in words:
        raise WrongError(f"must be one of {', '.join(map(str, words))}")
    return value


def read_object(fields: Fields, value: Any) -> Line:
    """Return an object as a Line with converted fields. Raises WrongError."""
    _require(isinstance(value, dict), "must be an object")
    line = Line()
    for name, may, kind in fields:
        if name in value and not (may and value[name] is None):
            try:
                line.__dict__["start" if name == "from" else name] = read(kind, value[name])
            except WrongError as error:
                raise WrongError(f"`{name}` {error}") from None
        else:
            _require(may, f"has no `{name}`")
    return line


def _memory(value: Any) -> dict[str, Any]:
    kinds = read("any~", value)
    for name, kind in kinds.items():
        kinds[name] = kind if kind == "bool" else read("range", kind)
        _require(kind == "bool" or kind[0] <= kind[1], "has an empty range")
    return dict(kinds)


def _objective(value: Any) -> Objective:
    rest = read("any~", value)
    form, avoid, always = (rest.pop(key, None) for key in ("form", "avoid", "always"))
    _require(len(rest) == 1, "must have one kind")
    ((kind, body),) = rest.items()
    read("patrol|visit|cover|hold|once|ltl", kind)
    avoid, always, targets = read("int!", avoid or []), read("str*", always or []), []
    if kind == "ltl":
        body = vars(read("ltl", body or {}))
    else:
        listed = [body] if kind == "hold" else read("any*", body)
        targets = [read("int!", one if isinstance(one, list) else [one]) for one in listed]
        _require(targets and all(targets), "must have targets")
    ltl = kind == "ltl"
    formulas = Formulas(body if ltl else {}, always) if ltl or always else None
    data = json.dumps([[sorted(one) for one in targets] or body, sorted(avoid), always])
    about = {"targets": targets, "avoid": avoid, "always": always, "data": data}
    parts = ("init", "safety", "liveness") if ltl else ()
    about["texts"] = [f"{part} {text}" for part in parts for text in body.get(part, ())]
    count = formulas.count if formulas and ltl else len(targets)
    return Objective(kind, formulas=formulas, count=count, literal=form == "literal", **about)


def _pose(value: Any) -> tuple[int, str | None]:
    pose, headings = read("facing", value), dict(enumerate(HEADINGS))
    _require(pose.heading is None or pose.heading in headings, "has an unknown heading")
    return pose.region, headings.get(pose.heading)


def _robot(value: Any) -> Line:
    """Return a robot of the header with the fields of its model."""
    robot = read("member", value)
    return Line(**vars(robot.model) | vars(robot))


def _obstacle(value: Any) -> Line:
    """Return an obstacle of the header with its ``name``."""
    one = read("hidden", value)
    number = f"#{one.number}" if one.number > 1 else ""
    return Line(**vars(one), name=f"{one.type.name}@{one.region}{number}")


VALUES: dict[str, tuple[tuple[type, ...], int | None]] = {
    **{"int": ((int,), None), "str": ((str,), None), "bool": ((bool,), None)},
    **{"number": ((int, float), 0), "count": ((int,), 0), "times": ((int,), 1)},
    **{"truth": ((bool, type(None)), None), "least": ((int, type(None)), None)},
}
"""Types of JSON values, each with its least value."""
TUPLES = {
    **{"place": ("int", "heading"), "span": ("count", "count"), "range": ("int", "int")},
    **{"mark": ("int", "str"), "order": ("str", "count", "str", "count")},
    "when": ("str", "objective"),
}
MADE: dict[str, Callable[[Any], Any]] = {
    "known": lambda value: read("int" if type(value) is int else "int*", value),
    "at": lambda value: read("self|neighbours" if type(value) is str else "int!", value),
    "any": lambda value: value,
    **{"memory": _memory, "objective": _objective, "pose": _pose, "robot": _robot},
    "obstacle": _obstacle,
}
OBJECTS = {
    kind: _fields(text)
    for kind, text in {
        "ltl": "memory?:memory inputs?:str* init?:str* safety?:str* liveness?:str*",
        "facing": "region:int heading?:count",
        "battery": "capacity:count start:count move:count stay:number charge:count",
        "model": "name mobility:free|heading layer capabilities:str! vision?:number timing:count"
        " battery?:battery",
        "member": "name model:model start:pose objective:objective avoids?:str! within?:count"
        " when:when*",
        "need": "action at:at robots:count together:bool same:bool",
        "type": "name needs:need+ blocks?:str! resolve_within?:count",
        "hidden": "type:type region:int traversable?:bool appears?:count goes?:count"
        " resolve_within?:count ordered:bool number:count",
        "change": "at:count robot objective?:objective active?:bool within?:count",
        "zone": "robots:str! regions:int!",
        "input": "name spans:span* again:bool*",
        "map": "rows:count cols:count walls:int! names:int~ areas:int!~",
        "until": "rounds:times by?:count",
        "limits": "ticks:count seconds?:number",
        "proof": "robots:str! memory?:int~~",
        "scenario": "map:map robots:robot* obstacles:obstacle* until:until limits:limits"
        " clock:lockstep|live seed:int coordination:resynthesis|assignable changes:change*"
        " never_together:zone* resolve_within?:count late:go_on|stop chargers:int! flat?:type"
        " inputs:input*",
    }.items()
}
_MOVED = "robot from:int to:int heading:heading"
_CAUSE = "cause:scenario|world|user"
_ENDS = (
    "explanation proof?:proof cause?:no_capable_robot|cyclic_requests|unrealizable|deadlock"
    "|never_resolvable|out_of_service"
)
_AVERTED = "operator_needed|assumption_violated|search_limit|time_limit"
_ENDED = "completed|unrealizable|tick_limit|late|interrupted|error"
_BY, _RESULT = "strategy|backtrack|plan|stay", "arrived|elsewhere|blocked|failed|lost"
KINDS = {
    kind: _fields(f"tick{'?' * (kind == 'header')}:count t?:number {text}")
    for kind, text in {
        "header": "trace:int scenario:scenario world:simulated|external cells?:int!*",
        "move": f"{_MOVED} toward?:int by?:{_BY} result?:{_RESULT}",
        "depart": f"{_MOVED} by:{_BY} node?:count",
        "arrive": f"robot at:int heading:heading result:{_RESULT} regions?:int!",
        "act": "robot robots:str* obstacles:str*",
        "acted": "robot results:done|untraversable|failed|nothing~ reason? barred?:str*",
        "synthesis": "robot verdict:realizable|unrealizable|timeout|out_of_memory spec node?:count"
        " objective:objective memory?:int~ places?:int! strategy? region?:int heading?:heading"
        " form?:literal|other_memory|alternation closed?:mark* knowledge?:known~ beliefs?:int!*~"
        " sight_closed?:int! inputs?:bool~ forbidden?:place!",
        "plan": "robots:place*~ orders:order*",
        "plan_end": "reason:reached|violation|changed",
        "duty": "objectives:objective~",
        "violation": "robot obstacle",
        "request": "obstacle",
        "discovered": "obstacle:obstacle",
        "appeared": f"obstacle {_CAUSE}|battery",
        "gone": f"obstacle {_CAUSE}",
        "order": f"obstacle {_CAUSE}",
        "truth": f"obstacle {_CAUSE} traversable:bool",
        "part": "obstacle need:count robot at:int robots?:str*",
        "resolved": "obstacle robot at:int traversable:truth robots?:str*",
        "blocked": "obstacle robots:str!"
        " reason:untraversable|no_capable_robot|unresolvable|operator",
        "reopened": "obstacle",
        "objective": "robot objective:objective at_once:bool cause:scenario|user|input"
        " within?:count",
        "inputs": "values:bool~ user?:str*",
        "service": f"robot active:bool {_CAUSE}|battery",
        "operator": "intervention:resolved|permanent|put_back|out_of_service|objective|added"
        "|give_up robot? obstacle? region?:int heading?:heading",
        "goal": "robot goal:count region:int round:count duty?:bool",
        "assumption": "robot",
        "deadline": "of due:count verdict:set|kept|late|excused|lost earliest?:count",
        "checkpoint": "lines:count",
        "waiting": f"outcome:{_AVERTED} {_ENDS} unrealizable?:str~",
        "outcome": f"outcome:{_AVERTED}|{_ENDED} {_ENDS} rounds:count~ ticks:count"
        " unrealizable?:str~ late?:str* refused?:least~ makespan?:number",
    }.items()
}
"""The types of facts, which are judged. All other lines are notes, which explain."""

for _name in {name for each in (*KINDS.values(), *OBJECTS.values()) for name, _, _ in each}:
    setattr(Line, "start" if _name == "from" else _name, None)  # like ``__getattr__``, but fast


Text = str | bytes | dict[str, Any]
"""A line of a trace, or the data of one that was read without flaws."""


class Reader:
    """Reader of the lines of one trace. ``read``: the number of lines read; ``cut_off``: whether
    the last line is incomplete because its writer was killed."""

    def __init__(self) -> None:
        self.read, self.cut_off = 0, False
        self._robots: set[str] = set()
        self._obstacles: set[str] = set()

    def lines(self, texts: Iterable[Text]) -> Iterator[Line]:
        """Yield the lines that the rules judge. Raises NotATraceError."""
        for text in texts:
            self.read += 1
            try:
                line = self._line(text)
            except (WrongError, UnreadError, RecursionError) as error:
                raise NotATraceError(f"line {self.read}: {error}") from None
            if line is not None:
                yield line
        if not self._robots:
            raise NotATraceError("there is no header, or no robot in it")

    def _line(self, text: Text) -> Line | None:
        if isinstance(text, dict):
            return self._fact(text, text["type"])
        _require(not self.cut_off, "follows a line that is not JSON")
        _require(len(text) <= MOST_BYTES, f"longer than {MOST_BYTES} bytes")
        if not text.strip():
            return None
        try:
            data = read_json(text)
        except ValueError as error:
            ends = text[-1:] in ("\n", b"\n")
            _require(self._robots and not ends, f"not JSON: {error}")
            self.cut_off = True
            return None
        kind: Any = data.get("type") if isinstance(data, dict) else None
        _require(isinstance(kind, str), "not an object with a `type`")
        first = (kind == "header") is not bool(self._robots)
        _require(first, "the header must be the first line, and no other")
        flaw = note_flaw(data, kind, fact=kind in KINDS)
        _require(not flaw, flaw)
        fact = self._fact(data, kind)
        for flaw in flaws(data, kind):
            raise WrongError(flaw)
        return fact

    def _fact(self, data: dict[str, Any], kind: str) -> Line | None:
        if kind not in KINDS or kind == "checkpoint":  # checkpoints are for `resume` only
            return None
        line = read_object(KINDS[kind], data)
        line.kind, line.number, line.tick = kind, self.read, line.tick or 0
        if kind == "synthesis":
            about = {key: data[key] for key in sorted(data) if key not in PASSING}
            line.__dict__["text"] = json.dumps(about)
        self._names(line)
        return line

    def _names(self, line: Line) -> None:
        """Check that the line names only known robots and obstacles."""
        robots = {*(line.robots or ()), *(line.objectives or ()), *(line.unrealizable or ())}
        robots |= {*line.proof.robots, *(line.proof.memory or ())} if line.proof else set()
        if line.kind == "header":
            _require(line.trace == VERSION, f"version {line.trace}; expected {VERSION}")
            h = line.scenario
            self._robots = {robot.name for robot in h.robots}
            self._obstacles = {one.name for one in h.obstacles}
            _require(len(h.robots) == len(self._robots), "two robots have one name")
            robots = robots.union({change.robot for change in h.changes})
            robots = robots.union(
                *(one.avoids or one.robots or () for one in (*h.robots, *h.never_together))
            )
        elif line.kind == "discovered":
            name = line.obstacle.name
            _require(name not in self._obstacles | self._robots, f"{name} already exists")
            self._obstacles.add(name)
        else:
            robots |= {line.robot} if line.robot is not None else set()
            name = line.obstacle
            _require(name is None or name in self._obstacles, f"no obstacle {name}")
        strangers = robots - self._robots
        _require(not strangers, f"no robot {', '.join(sorted(strangers))}")
