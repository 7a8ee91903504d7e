"""Objectives of robots (docs/objectives.md), a class for each kind.

A target is a set of regions, any of which counts. A kind consists of its data, its words, and the
moves that it forbids. The order in which its targets count is a ``Pursuit``. The specification
states both in formulas (``spec.compile``); the runtime, joint plans and graph searches use the
pursuit. The judge deliberately has its own class (``judge.lines``). All other code queries the kind
and never names it.

Raw formulas (``ltl``) have goals instead of targets, which count in any order; the synthesizer
makes their automaton.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations, groupby
from types import MappingProxyType
from typing import ClassVar, NamedTuple, Self

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.formula import syntax
from safenav.scenario.yaml.document import flow, one_of
from safenav.world.map import Region
from safenav.world.poses import bits

Target = frozenset[Region]
"""Regions, any of which counts."""

Word = Callable[[Region | Target], str]
"""A function that returns the name of a region or target (``RegionMap.word``)."""


def number_word(place: Region | Target) -> str:
    """Return the number of a region or the numbers of a target's regions: ``47|58``."""
    return str(place) if isinstance(place, int) else "|".join(map(str, sorted(place)))


class Pursuit(NamedTuple):
    """The order in which a number of ``targets`` count. A target is an index, a set of targets a
    mask with a bit for each. The memory is the next target if targets count ``in_turn``, else the
    set of those met in this round. ``settles``: whether the objective ends at the last target,
    where each tick is a round."""

    targets: int
    in_turn: bool
    settles: bool

    def met(self, memory: int, here: int) -> int:
        """Return the reached targets ``here`` that count now."""
        return here & 1 << memory if self.in_turn else here

    def awaited(self, memory: int) -> int:
        """Return the targets one of which the robot must reach next."""
        return 1 << memory if self.in_turn else (1 << self.targets) - 1 & ~memory

    def step(self, memory: int, here: int) -> tuple[int, int]:
        """Return the memory after a turn in which the robot reaches the targets ``here``, and a
        count: of met goals (targets in turn) or of completed rounds (any order). If the objective
        settles, only the last target is a goal."""
        if not self.in_turn:
            seen = memory | here
            return (seen, 0) if seen + 1 < 1 << self.targets else (0, 1)
        if not here >> memory & 1:
            return memory, 0
        last = memory == self.targets - 1
        if self.settles:
            return memory + (not last), int(last)
        return 0 if last else memory + 1, 1

    def rounds(self, met: int) -> int:
        """Return the number of complete rounds after ``met`` counts (see ``step``)."""
        return met // self.targets if self.in_turn and not self.settles else met


class Objective:
    """An objective of a robot (a class for each kind). Its targets are numbered in its own order.
    ``avoid``: regions that the robot never enters; ``always``: formulas over ``region`` and
    ``heading`` that each of its steps keeps. Both always hold, even while the robot helps another.
    ``literal``: whether no weaker form of a ``strict`` kind is accepted.

    ``kind``: its key in a scenario; ``meaning``: a short description, for editors; ``drawing``: its
    verb phrase while a user clicks its targets; ``one``: whether it has a single target, not a
    list; ``least``: the minimum number of its targets; ``in_turn``: whether they count only in
    their order; ``turn``: the specification variable of the next target, if there are several.
    ``settles``: whether it ends at its last target, where each tick is a round. ``strict``: whether
    the robot leaves each target with its next step and touches none out of turn. If it cannot,
    plain alternation (``relaxed``) suffices, unless the objective is ``literal`` (``spec.task``).
    ``formulas``: formulas of its goals, also about ``memory`` and ``inputs``."""

    __slots__ = ()
    kind: ClassVar[str]
    meaning: ClassVar[str]
    drawing: ClassVar[str]
    one: ClassVar[bool] = False
    least: ClassVar[int] = 1
    in_turn: ClassVar[bool] = False
    turn: ClassVar[str] = ""
    settles: ClassVar[bool] = False
    strict: ClassVar[bool] = False
    targets: tuple[Target, ...] = ()
    avoid: Target = frozenset()
    always: tuple[str, ...] = ()
    literal: bool = False
    memory: Mapping[str, tuple[int, int] | None] = MappingProxyType({})
    inputs: tuple[str, ...] = ()

    @classmethod
    def timed(cls) -> bool:
        """Return whether rounds of this objective can have a deadline in ticks."""
        return cls.in_turn and not cls.settles

    @classmethod
    def ordered(cls) -> bool:
        """Return whether the memory of this kind always determines the next target."""
        return cls.in_turn or cls.one

    @classmethod
    def wrong(cls, targets: Sequence[Target]) -> tuple[str, str] | None:
        """Return the error in these targets, as words after a name, and its remedy; None if there
        is none."""
        del targets
        return None

    def words(self, word: Word) -> str:
        """Return the objective in a few words."""
        return f"{self.kind} " + ", ".join(map(word, self.targets))

    def relaxed(self) -> Objective:
        """Return plain alternation if strict and not ``literal``, else this objective."""
        weaker = self.strict and not self.literal
        return alternation(self.targets, self) if weaker else self

    def begin(self, region: Region, memory: int = 0) -> int:
        """Return the memory of a robot in ``region`` that gets this objective. ``memory``: the
        robot's previous memory."""
        del region
        return memory

    @property
    def formulas(self) -> Ltl | None:
        return None

    @property
    def goals(self) -> int:
        return len(self.targets)

    @property
    def pursuit(self) -> Pursuit:
        """The order in which the objective's targets count."""
        return Pursuit(len(self.targets), self.in_turn, self.settles)

    def changed(self, **parts: object) -> Self:
        """Return this objective with other values in some fields."""
        return replace(self, **parts)  # type: ignore[type-var]  # its classes are structs

    def waiting(self, places: Target) -> Objective:
        """Return an objective to go to a target and stay, under the rules of this one."""
        return staying(places, self)

    def alternating(self, places: Target, own: Target | None) -> Objective:
        """Return an objective to go to a target infinitely often, in turn with its ``own`` target,
        under the rules of this one."""
        return alternation((places,) if own is None else (places, own), self)

    def reached(self, region: Region) -> int:
        """Return the targets that contain ``region``, as a mask."""
        return sum(1 << i for i, target in enumerate(self.targets) if region in target)

    def met(self, memory: int, region: Region) -> tuple[int, ...]:
        """Return the indices of the targets that a robot in ``region`` meets."""
        return tuple(bits(self.pursuit.met(memory, self.reached(region))))

    def turned(self, memory: int, region: Region) -> int:
        """Return the memory of a robot after a turn that began in ``region``."""
        return self.pursuit.step(memory, self.reached(region))[0]

    def forbidden(self, memory: int, region: Region, after: Region) -> bool:
        """Return whether the objective itself forbids the step from ``region`` to ``after``."""
        if self.strict:
            now = self.turned(memory, region)
            return any(after in target for i, target in enumerate(self.targets) if i != now)
        return self.stays(memory, region) and after != region

    def stays(self, memory: int, region: Region) -> bool:
        """Return whether a robot in ``region`` must stay there, at its last target."""
        return self.settles and len(self.targets) - 1 in self.met(memory, region)


class TargetObjective(Objective, Struct, frozen=True):
    """An objective to visit targets or to stay at the last one."""

    targets: tuple[Target, ...]
    avoid: Target = frozenset()
    always: tuple[str, ...] = ()
    literal: bool = False


class Patrol(TargetObjective, frozen=True):
    """Visits to the targets in turn, forever: the robot leaves each with the next step and touches
    none out of turn. With two targets the paper's Patrol formula (Section VI), with more the strict
    ordered patrolling of Menghi et al. (IEEE TSE 2021)."""

    kind: ClassVar[str] = "patrol"
    in_turn: ClassVar[bool] = True
    strict: ClassVar[bool] = True
    least: ClassVar[int] = 2
    meaning: ClassVar[str] = "its targets in turn, none out of turn"
    drawing: ClassVar[str] = "patrols between regions"
    turn: ClassVar[str] = "scout"

    @classmethod
    def wrong(cls, targets: Sequence[Target]) -> tuple[str, str] | None:
        if len(set(targets)) == 1:
            one = ": found 1 target, expected two or more"
            found = one if len(targets) == 1 else ": all targets are the same"
            return found, "use 'hold' to stay in one region"
        for first, second in combinations(targets, 2):
            if first == second:
                return ": two targets are the same", "use 'visit', which allows it"
            if first & second:
                shared = ", ".join(str(region) for region in sorted(first & second))
                return f": two targets share region {shared}", "use 'visit', which allows it"
        return super().wrong(targets)

    def words(self, word: Word) -> str:
        arrow = " <-> " if len(self.targets) == 2 else " -> "
        literally = " (form: literal)" if self.literal else ""
        return f"patrol {arrow.join(map(word, self.targets))}{literally}"

    def begin(self, region: Region, memory: int = 0) -> int:
        """Return the index of the target that contains ``region``, if any: the formula forbids a
        target out of turn (paper, Section VI). Otherwise, and for more than two targets, return
        ``memory``, since a robot that charges on a target could miss the others forever."""
        if len(self.targets) > 2:
            return memory
        return next((i for i, target in enumerate(self.targets) if region in target), memory)


class Visit(TargetObjective, frozen=True):
    """Visits to the targets in order, forever; passing another target on the way is allowed."""

    kind: ClassVar[str] = "visit"
    meaning: ClassVar[str] = "all of its targets, in order"
    drawing: ClassVar[str] = "visits regions in order"
    in_turn: ClassVar[bool] = True
    turn: ClassVar[str] = "goal"

    def words(self, word: Word) -> str:
        names = [word(target) for target, _ in groupby(self.targets)]
        return f"visit {', '.join(names)}" + (" in turn" if len(names) > 1 else "")


class Cover(TargetObjective, frozen=True):
    """Visits to all targets in any order, forever."""

    kind: ClassVar[str] = "cover"
    meaning: ClassVar[str] = "all of its targets, in any order"
    drawing: ClassVar[str] = "covers regions in any order"


class Hold(TargetObjective, frozen=True):
    """One visit to the target, which never ends (the paper's Patrol(s, s))."""

    kind: ClassVar[str] = "hold"
    meaning: ClassVar[str] = "go to a region and stay there"
    drawing: ClassVar[str] = "holds one region"
    one: ClassVar[bool] = True
    settles: ClassVar[bool] = True


class Once(TargetObjective, frozen=True):
    """One visit to each target, in order; the last visit never ends."""

    kind: ClassVar[str] = "once"
    meaning: ClassVar[str] = "each target once, in order, then stay at the last"
    drawing: ClassVar[str] = "visits regions in order, once"
    in_turn: ClassVar[bool] = True
    turn: ClassVar[str] = "goal"
    settles: ClassVar[bool] = True

    @classmethod
    def wrong(cls, targets: Sequence[Target]) -> tuple[str, str] | None:
        if len(targets) > 1 and (shared := targets[-1] & targets[-2]):
            regions = f"region{'s' * (len(shared) > 1)} {', '.join(map(str, sorted(shared)))}"
            found = f": the last two targets share {regions}"
            return found, "leave one of them out: staying there meets both"
        return super().wrong(targets)

    def words(self, word: Word) -> str:
        return "visit " + ", ".join(map(word, self.targets)) + " once and stay there"


KINDS: Mapping[str, type[TargetObjective]] = {
    found.kind: found for found in (Patrol, Visit, Cover, Hold, Once)
}
"""The kinds of objectives about targets, by their keys in scenarios."""

STAYING: type[TargetObjective] = Hold
"""The kind of a robot that waits, charges or has no task yet."""
ALTERNATING: type[TargetObjective] = Visit
"""The kind of a helper, and the weakest form of a strict kind."""
EXAMPLE = f"{{{Patrol.kind}: [14, 20]}}"
"""An example of an objective for messages."""


class Ltl(Objective, Struct, frozen=True):
    """Guarantees in the structured-slugs language over the robot's own variables
    (``region``, ``heading``) and declared memory.

    ``memory`` maps a name to None (Boolean) or to its (min, max). ``inputs``: the environment's
    inputs that the formulas name. It has no targets; only its formulas forbid steps. Its goals are
    about steps.
    """

    init: tuple[str, ...] = ()
    safety: tuple[str, ...] = ()
    liveness: tuple[str, ...] = ()
    memory: Mapping[str, tuple[int, int] | None] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()

    def __hash__(self) -> int:
        return hash((self.init, self.safety, self.liveness, tuple(sorted(self.memory))))

    @property
    def formulas(self) -> Ltl:
        return self

    @property
    def goals(self) -> int:
        return len(self.liveness)

    @property
    def pursuit(self) -> Pursuit:
        """The order in which the goals count; without goals each step is a round."""
        return Pursuit(max(1, self.goals), in_turn=False, settles=False)

    def heard(self, on: frozenset[str]) -> dict[str, int]:
        """Return the values of the inputs that the formulas name. ``on``: all that are on."""
        return {name: int(name in on) for name in self.inputs}

    def waiting(self, places: Target) -> Ltl:
        """Return an objective to go to a target and stay, under the rules of this one."""
        there = syntax.one_of("region", places)
        stay = f"{there} -> region' = {next(iter(places)) if len(places) == 1 else 'region'}"
        return replace(self, safety=(*self.safety, stay), liveness=(there,))

    def alternating(self, places: Target, own: Target | None) -> Ltl:
        """Return an objective to visit a target infinitely often, under the rules of this one."""
        del own
        return replace(self, liveness=(syntax.one_of("region", places),))


def target_regions(objective: Objective | None) -> frozenset[Region]:
    """Return all regions of an objective's targets."""
    return frozenset().union(*objective.targets) if objective is not None else frozenset()


def unordered(name: str, objective: Objective | None) -> tuple[str, str] | None:
    """Return an error and its remedy if a robot with a battery has an objective with unordered
    targets, else None."""
    if objective is None or objective.ordered():
        return None
    found = f"{name} has a battery, and an objective without an order of its targets"
    kinds = kinds_that(lambda kind: kind.ordered())
    return found, f"use {one_of(kinds, chr(39))}"


def kinds_that(has: Callable[[type[TargetObjective]], bool] = bool) -> tuple[str, ...]:
    """Return the keys of the kinds that ``has`` accepts, in the order of ``KINDS``."""
    return tuple(key for key, kind in KINDS.items() if has(kind))


def alternation(targets: Sequence[Target], like: Objective) -> Objective:
    """Return an objective to visit targets in turn, under the rules of another one."""
    return ruled(ALTERNATING(tuple(targets)), like)


def staying(target: Target, like: Objective | None = None) -> Objective:
    """Return an objective to go to a target and stay, under the rules of another one."""
    objective = STAYING((target,))
    return objective if like is None else ruled(objective, like)


def station(objective: Objective) -> Target | None:
    """Return the target of an objective to go to a target and stay, None for any other."""
    return objective.targets[0] if isinstance(objective, STAYING) else None


def formulas_in(objective: Objective) -> Ltl | None:
    """Return the formulas that restrict a robot's steps; None if there are none."""
    if objective.formulas is None and objective.always:
        return Ltl(safety=tuple(map(on_steps, objective.always)))
    return objective.formulas


def on_steps(formula: str) -> str:
    """Return a formula restricted to steps that change the region, since the team must be able to
    let every robot wait."""
    return f"region' = region | ({formula})"


def ruled(objective: Objective, like: Objective) -> Objective:
    """Return an objective to visit targets, under the rules of another objective."""
    return objective.changed(avoid=like.avoid, always=like.always)


_SHOWN = 2
"""Maximum number of formulas of ``always`` that ``describe`` lists."""


def describe(objective: Objective, word: Word = number_word) -> str:
    """Return the objective in a few words for people: ``patrol 58 <-> 28`` or, with
    ``RegionMap.word``, ``patrol dock <-> ward_a``."""
    if isinstance(objective, Ltl):
        safety, liveness = len(objective.safety), len(objective.liveness)
        return f"meet its formulas ({safety} safety, {liveness} liveness)"
    text = objective.words(word)
    if objective.avoid:
        text += f", never in {word(objective.avoid).replace('|', ', ')}"
    if len(objective.always) > _SHOWN:
        return f"{text}, under its {len(objective.always)} 'always' formulas"
    return text + "".join(f", always {formula}" for formula in objective.always)


def written(objective: Objective, word: Word = number_word) -> str:
    """Return an objective (not formulas) in a scenario's form: ``{patrol: [dock, shelf]}``."""

    def target(regions: Target) -> object:
        words = [int(each) if each.isdigit() else each for each in word(regions).split("|")]
        return words[0] if len(words) == 1 else {"any": words}

    listed = [target(regions) for regions in objective.targets]
    rules = {
        "form": "literal" if objective.literal else None,
        "avoid": [target(frozenset({region})) for region in sorted(objective.avoid)] or None,
        "always": objective.always or None,
    }
    return flow({objective.kind: listed[0] if objective.one else listed, **rules})
