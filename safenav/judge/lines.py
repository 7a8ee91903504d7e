"""The one reader: a trace (docs/trace.md) as lines with typed fields.

Everything is checked here before a rule sees it: JSON without repeated keys, names and sizes
(``strict_json``), the fields of each type of line with their words, and that robots and obstacles
are known. Lines and fields that only explain are dropped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from safenav.judge.formulas import HEADINGS, Formulas, UnreadError
from safenav.strict_json import flaws, note_flaw, read_json

VERSION = 4
PASSING = ("tick", "t", "reason", "seconds", "cached")
"""Fields of a synthesis that say nothing of its task; the others are its ``text``."""
MOST_BYTES = 10_000_000
"""Bytes of a line."""


class NotATraceError(ValueError):
    """The lines are not a trace; the message says where and why."""


class Line:
    """A line, or a part of one; a missing field is None. ``start`` is ``from`` of the file."""

    kind: str
    robot: str
    tick: int
    t: float | None
    number: int

    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        return None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Line) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]


class Objective(Line):
    """``targets``: for each its regions, none for formulas; ``formulas``: of ``ltl`` and
    ``always``, None if there are none. ``settles``: the robot stays at its ``last`` target, where
    each tick is a round; ``single``: from its first arrival on, ``ends``: after it has met each
    target once. ``strict``: it leaves a target immediately, and touches none out of turn."""

    targets: list[frozenset[int]]

    def __init__(self, kind: str, **fields: Any) -> None:
        super().__init__(kind=kind, **fields)
        self.single, self.ends, self.strict = kind == "hold", kind == "once", kind == "patrol"
        self.settles, self.covers = self.single or self.ends, kind == "cover"
        self.in_turn = self.strict or self.ends or kind == "visit"

    def __eq__(self, other: object) -> bool:
        keys = ("kind", "data", "literal")
        return all(getattr(self, key) == getattr(other, key, None) for key in keys)

    @property
    def last(self) -> frozenset[int]:
        return self.targets[-1]

    def alternating(self) -> Objective:
        """Return the weaker form of a strict objective: the same targets in turn."""
        return Objective(**vars(self) | {"kind": "visit"}) if self.strict else self

    def serves(self, own: Objective) -> bool:
        """Return whether the goals of this objective are those of another one, of which it may be
        the weaker form."""
        alternate = self.in_turn and own.in_turn and not (self.settles or own.settles)
        return (self.kind == own.kind or alternate) and self.data == own.data


class WrongError(Exception):
    """A value has another type than its field."""


Read = Callable[[Any], Any]


def _of(*types: type) -> Read:
    def read(value: Any) -> Any:
        if type(value) not in types:
            raise WrongError(f"must be {' or '.join(one.__name__ for one in types)}")
        return value

    return read


def _count(value: Any) -> int:
    if type(value) is not int or value < 0:
        raise WrongError("must be a whole number of at least 0")
    return value


def _list(read: Read, made: Callable[[Iterable[Any]], Any] = tuple) -> Read:
    def each(value: Any) -> Any:
        if not isinstance(value, list):
            raise WrongError("must be a list")
        return made([read(one) for one in value])

    return each


def _by_name(read: Read) -> Read:
    def each(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise WrongError("must be an object")
        return {name: read(one) for name, one in value.items()}

    return each


def _pair(*reads: Read) -> Read:
    def each(value: Any) -> Any:
        if not isinstance(value, list) or len(value) != len(reads):
            raise WrongError(f"must be a list of {len(reads)} values")
        return tuple(read(one) for read, one in zip(reads, value, strict=True))

    return each


def _word(*words: str | None) -> Read:
    def read(value: Any) -> Any:
        if value not in words:
            raise WrongError(f"must be one of {', '.join(map(str, words))}")
        return value

    return read


_INT, _STR, _BOOL = _of(int), _of(str), _of(bool)
_HEADING = _word(*HEADINGS, None)
READS: dict[str, Read] = {
    **{"int": _INT, "str": _STR, "bool": _BOOL, "number": _of(int, float), "count": _count},
    **{"heading": _HEADING, "truth": _of(bool, type(None)), "least": _of(int, type(None))},
    **{"place": _pair(_INT, _HEADING), "span": _pair(_count, _count), "mark": _pair(_INT, _STR)},
    "order": _pair(_STR, _count, _STR, _count),
    "known": lambda one: read_of("int" if type(one) is int else "int*")(one),
    "at": lambda one: read_of("self|neighbours" if type(one) is str else "int!")(one),
}
"""The types of values."""


def read_of(kind: str) -> Read:
    """Return the reader of a type: one of ``READS``, one of several words (``a|b``), or, for a type
    ``x``, a list (``x*``), a set (``x!``) or an object of them by name (``x~``)."""
    if kind[-1] in "*!~":
        inner = read_of(kind[:-1])
        return _by_name(inner) if kind[-1] == "~" else _list(inner, _MADE[kind[-1]])
    return _word(*kind.split("|")) if "|" in kind else READS[kind]


_MADE: dict[str, Callable[[Iterable[Any]], Any]] = {"*": tuple, "!": frozenset}


def _object(text: str) -> Read:
    """Read an object with these fields, each as ``name:type``, with ``?`` if it may be absent."""
    words = [word.partition(":") for word in text.split()]
    fields = [
        (name.rstrip("?"), name.endswith("?"), read_of(kind or "str")) for name, _, kind in words
    ]

    def read(value: Any) -> Line:
        if not isinstance(value, dict):
            raise WrongError("must be an object")
        line = Line()
        for name, may, each in fields:
            if name in value and not (may and value[name] is None):
                try:
                    line.__dict__["start" if name == "from" else name] = each(value[name])
                except WrongError as error:
                    raise WrongError(f"`{name}` {error}") from None
            elif not may:
                raise WrongError(f"has no `{name}`")
        return line

    return read


def _memory(value: Any) -> Any:
    kinds = _by_name(lambda kind: kind if kind == "bool" else _pair(_INT, _INT)(kind))(value)
    if any(kind != "bool" and kind[0] > kind[1] for kind in kinds.values()):
        raise WrongError("has an empty range")
    return kinds


READS["memory"] = _memory
_ltl = _object("memory?:memory inputs?:str* init?:str* safety?:str* liveness?:str*")


def _objective(value: Any) -> Objective:
    rest = dict(_by_name(lambda inner: inner)(value))
    form, avoid, always = (rest.pop(key, None) for key in ("form", "avoid", "always"))
    if len(rest) != 1:
        raise WrongError("must have one kind")
    ((kind, body),) = rest.items()
    if kind not in ("patrol", "visit", "cover", "hold", "once", "ltl"):
        raise WrongError(f"has the unknown kind {kind}")
    targets, always = list[frozenset[int]](), _list(_STR)(always or [])
    if kind == "ltl":
        body = vars(_ltl(body or {}))
    else:
        listed = [body] if kind == "hold" else _list(lambda one: one, list)(body)
        targets = [read_of("int!")(one if isinstance(one, list) else [one]) for one in listed]
        if not targets or not all(targets):
            raise WrongError("must have targets")
    rules = read_of("int!")(avoid or []), always
    asks = kind == "ltl" or always
    formulas = Formulas(body if kind == "ltl" else {}, always) if asks else None
    data = json.dumps([[sorted(one) for one in targets] or body, sorted(rules[0]), rules[1]])
    about = {"targets": targets, "avoid": rules[0], "always": always, "data": data}
    about["literal"] = form == "literal"
    liveness = formulas.count if formulas and kind == "ltl" else len(targets)
    return Objective(kind=kind, formulas=formulas, count=liveness, **about)


READS["objective"] = _objective
_facing = _object("region:int heading?:count")


def _pose(value: Any) -> tuple[int, str | None]:
    pose = _facing(value)
    if pose.heading is not None and pose.heading >= len(HEADINGS):
        raise WrongError("has an unknown heading")
    return pose.region, None if pose.heading is None else HEADINGS[pose.heading]


READS |= {"pose": _pose, "when": _pair(_STR, _objective)}
READS["battery"] = _object("capacity:count start:count move:count stay:number charge:count")
READS["model"] = _object(
    "name mobility:free|heading layer capabilities:str! vision?:number timing:count"
    " battery?:battery"
)
_member = _object(
    "name model:model start:pose objective:objective avoids?:str! within?:count when:when*"
)
READS["need"] = _object("action at:at robots:count together:bool same:bool")
_kind = _object("name action resolve_at:at blocks?:str! listed:need* resolve_within?:count")


def _robot(value: Any) -> Line:
    """Return a robot with the fields of its model."""
    robot = _member(value)
    return Line(**vars(robot.model) | vars(robot))


def _type(value: Any) -> Line:
    """Return a type of obstacles with all its ``needs``."""
    kind, one = _kind(value), {"robots": 1, "together": False, "same": False}
    needs = kind.listed or [Line(action=kind.action, at=kind.resolve_at, **one)]
    return Line(**vars(kind), needs=needs)


READS |= {"robot": _robot, "type": _type, "flat": lambda value: _type(value).name}
_hidden = _object(
    "type:type region:int traversable?:bool appears?:count goes?:count resolve_within?:count"
    " ordered:bool number:count"
)


def _obstacle(value: Any) -> Line:
    """Return an obstacle with its ``name``."""
    one = _hidden(value)
    number = f"#{one.number}" if one.number > 1 else ""
    return Line(**vars(one), name=f"{one.type.name}@{one.region}{number}")


READS["obstacle"] = _obstacle
for _name, _text in {
    "change": "at:count robot objective?:objective active?:bool within?:count",
    "zone": "robots:str! regions:int!",
    "input": "name spans:span* again:bool*",
    "map": "rows:count cols:count walls:int! names:int~ areas:int!~",
    "signal": "request:bool wait:bool assigned:int",
    "command": "places:int! from:place! memory?:int~",
    "until": "rounds:count by?:count",
    "limits": "ticks:count seconds?:number",
    "proof": "robots:str* memory?:int~~",
    "scenario": "map:map robots:robot* obstacles:obstacle* until:until limits:limits"
    " clock:lockstep|live seed:int coordination:resynthesis|assignable changes:change*"
    " never_together:zone* resolve_within?:count late:go_on|stop chargers:int! flat?:flat"
    " inputs:input*",
}.items():
    READS[_name] = _object(_text)
_MOVED = "robot from:int to:int heading:heading"
_CAUSE = "cause:scenario|world|user|input|battery"
_ENDS = (
    "explanation proof?:proof cause?:no_capable_robot|cyclic_requests|unrealizable|deadlock"
    "|never_resolvable|out_of_service"
)
_AVERTED = "operator_needed|assumption_violated|search_limit|time_limit"
_ENDED = "completed|unrealizable|tick_limit|late|interrupted|error"
_BY, _RESULT = "strategy|backtrack|plan|stay", "arrived|elsewhere|blocked|failed|lost"
KINDS = {
    kind: _object(text)
    for kind, text in {
        "header": "trace:int scenario:scenario world:simulated|external cells?:int!*",
        "move": f"{_MOVED} toward?:int by?:{_BY} result?:{_RESULT} signal?:signal",
        "depart": f"{_MOVED} by:{_BY} node?:count signal?:signal",
        "hold": "robot signal:signal",
        "arrive": f"robot at:int heading:heading result:{_RESULT} regions?:int!",
        "act": "robot robots:str* obstacles:str*",
        "acted": "robot results:done|untraversable|failed|nothing~ reason? barred?:str*",
        "synthesis": "robot verdict:realizable|unrealizable|timeout|out_of_memory spec node?:count"
        " objective:objective memory?:int~ places?:int! strategy? region?:int heading?:heading"
        " form?:literal|other_memory|alternation closed?:mark* knowledge?:known~ beliefs?:int!*~"
        " neutral?:int places_from?:command* sight_closed?:int! inputs?:bool~ forbidden?:place!",
        "plan": "robots:place*~ orders:order*",
        "plan_end": "reason:reached|violation|changed",
        "told": "robot objective:objective",
        "push": "obstacle objectives:objective~",
        "pop": "obstacle objectives:objective~",
        "violation": "robot obstacle",
        "request": "obstacle",
        "discovered": "obstacle:obstacle",
        "appeared": f"obstacle {_CAUSE}",
        "gone": f"obstacle {_CAUSE}",
        "order": f"obstacle {_CAUSE}",
        "truth": f"obstacle {_CAUSE} traversable:bool",
        "met": "obstacle need:count robot at:int action robots?:str*",
        "resolved": "obstacle robot at:int traversable:truth robots?:str*",
        "blocked": "obstacle robots:str!"
        " reason:untraversable|no_capable_robot|unresolvable|operator",
        "reopened": "obstacle",
        "objective": f"robot objective:objective at_once:bool {_CAUSE} within?:count",
        "inputs": "values:bool~ user?:str*",
        "service": f"robot active:bool {_CAUSE}",
        "operator": "intervention:resolved|permanent|put_back|out_of_service|objective|added"
        "|give_up robot? obstacle? region?:int heading?:heading",
        "goal": "robot goal:count region:int round:count",
        "assumption": "robot",
        "deadline": "of due:count verdict:set|kept|late|excused|lost earliest?:count",
        "checkpoint": "lines:count",
        "waiting": f"outcome:{_AVERTED} {_ENDS} until?:number",
        "outcome": f"outcome:{_AVERTED}|{_ENDED} {_ENDS} rounds:count~ ticks:count"
        " unrealizable?:str~ late?:str* refused?:least~",
    }.items()
}
"""The types of facts, which are judged; all other lines are marked as notes, and explain."""


class Reader:
    """Reads the lines of one trace. ``read``: how many there were; ``cut_off``: the last one is
    incomplete, since its writer was killed."""

    def __init__(self) -> None:
        self.read, self.cut_off = 0, False
        self._robots: set[str] = set()
        self._obstacles: set[str] = set()

    def lines(self, texts: Iterable[str | bytes]) -> Iterator[Line]:
        """Yield the lines that are judged. Raises NotATraceError."""
        for text in texts:
            if self.cut_off:
                raise NotATraceError(f"line {self.read} is not JSON")
            self.read += 1
            line = self._line(text) if text.strip() else None
            if line is not None:
                yield line
        if not self._robots:
            raise NotATraceError("there is no header, or no robot in it")

    def _line(self, text: str | bytes) -> Line | None:
        self.require(len(text) <= MOST_BYTES, f"longer than {MOST_BYTES} bytes")
        try:
            data = read_json(text)
        except ValueError as error:
            self.cut_off = True
            self.require(self._robots and not _ends(text), f"not JSON: {error}")
            return None
        kind = data.get("type") if isinstance(data, dict) else None
        if not isinstance(kind, str):
            raise NotATraceError(f"line {self.read}: not an object with a `type`")
        first = not self._robots
        self.require(first == (kind == "header"), "the header must be the first line, and no other")
        for flaw in flaws(data, kind):
            self.require(False, flaw)
        wrong = note_flaw(data, kind, fact=kind in KINDS)
        self.require(not wrong, wrong)
        if kind not in KINDS or kind == "checkpoint":  # a state of earlier lines, for `resume`
            return None
        tick, t = data.get("tick", 0 if first else None), data.get("t")
        self.require(type(tick) is int and tick >= 0, "`tick` must be a number of at least 0")
        self.require(t is None or type(t) in (int, float), "`t` must be a number")
        try:
            line: Line = KINDS[kind](data)
        except (WrongError, UnreadError, RecursionError) as error:
            self.require(False, str(error))
        line.kind, line.tick, line.t, line.number = kind, tick, t, self.read
        if kind == "synthesis":
            about = {key: data[key] for key in sorted(data) if key not in PASSING}
            line.__dict__["text"] = json.dumps(about)
        self._names(line)
        return line

    def _names(self, line: Line) -> None:
        """Require that all robots and obstacles that the line names are known."""
        if line.kind == "header":
            self.require(line.trace == VERSION, f"version {line.trace}; expected {VERSION}")
            names = [data.name for data in line.scenario.robots]
            self._robots, robots = {*names}, {change.robot for change in line.scenario.changes}
            self.require(len(names) == len(self._robots), "two robots have one name")
            self._obstacles = {one.name for one in line.scenario.obstacles}
            robots = robots.union(*(data.avoids or () for data in line.scenario.robots))
            robots = robots.union(*(zone.robots for zone in line.scenario.never_together))
        elif line.kind == "discovered":
            robots, name = set[str](), line.obstacle.name
            self.require(name not in self._obstacles | self._robots, f"{name} is known already")
            self._obstacles.add(name)
        else:
            robots = {*(line.robots or ()), *(line.objectives or ()), *(line.unrealizable or ())}
            robots |= {line.robot} if line.robot is not None else set()
            name = line.obstacle
            self.require(name is None or name in self._obstacles, f"no obstacle {name}")
        strangers = robots - self._robots
        self.require(not strangers, f"no robot {', '.join(sorted(strangers))}")

    def require(self, holds: object, problem: str) -> None:
        if not holds:
            raise NotATraceError(f"line {self.read}: {problem}")


def _ends(text: str | bytes) -> bool:
    return text.endswith("\n") if isinstance(text, str) else text.endswith(b"\n")
