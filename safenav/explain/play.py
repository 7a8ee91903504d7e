"""Queries about variants of a specification, within a budget; losing plays against the
counterstrategy (the environment's winning strategy); vacuous wins.

In a losing play the system obeys all guarantees while it can. It first meets the goals that the
environment does not prevent. Then it pursues a goal that it cannot meet, until it has no move or
the play repeats. If it could only stand still forever, it makes moves that end the play."""

import time
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from enum import StrEnum
from hashlib import sha256

from msgspec import Struct
from msgspec.structs import replace

from safenav.components import cyclic_parts, path_to, reached
from safenav.errors import ResourceLimitError, Verdict
from safenav.explain.explanation import LosingPlay, PlayEnd, Values
from safenav.spec.specification import Constraint, Origin, Owner, Section, Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, clauses, openings, rounds
from safenav.verify.completions import Clause

BUDGET_SECONDS = 60.0
"""Limit of one explanation without its repairs, in seconds of wall time."""
LISTED_MB = 64
"""Memory limit of the synthesis of a counterstrategy for a play, and limit of its text, in MiB."""

_COOPERATIVE = {
    Section.ENV_INIT: Section.SYS_INIT,
    Section.ENV_TRANS: Section.SYS_TRANS,
    Section.ENV_LIVENESS: Section.SYS_LIVENESS,
}


class Questions:
    """Queries of the synthesizer, with cached results; TIMEOUT for each after the budget's end."""

    def __init__(self, synthesizer: Synthesizer) -> None:
        self._synthesizer = synthesizer
        self._known: dict[bytes, Verdict] = {}
        self._begun = time.monotonic()
        self._share = 1.0

    def spend(self, share: float) -> None:
        """Refuse further queries once this share of the budget is used."""
        self._share = share

    @property
    def late(self) -> bool:
        """Whether the present share of the budget is used."""
        return self._left() <= 0

    def _left(self) -> float:
        return self._begun + self._share * BUDGET_SECONDS - time.monotonic()

    def _limited(self) -> Synthesizer:
        """Return the synthesizer with the limits of the next query."""
        limited = copy(self._synthesizer)
        limited.seconds = max(0.01, min(limited.seconds or BUDGET_SECONDS, self._left()))
        return limited

    def prepare(self, specs: Sequence[Specification]) -> None:
        """Query several verdicts in parallel, on all processors, and store the results."""
        found = {_key_of(spec): spec for spec in specs}
        left = [key for key in found if key not in self._known]
        while left and not self.late:
            some, left = left[: self._synthesizer.at_once], left[self._synthesizer.at_once :]
            wanted = [found[key] for key in some]
            results = self._limited().synthesize_all(wanted, strategy=False)
            self._known.update(zip(some, (result.verdict for result in results), strict=True))

    def verdict(self, spec: Specification) -> Verdict:
        """Return the verdict on a specification or the limit that the query has reached."""
        self.prepare([spec])
        return self._known.get(_key_of(spec), Verdict.TIMEOUT)

    def counterstrategy(self, spec: Specification) -> Strategy | None:
        """Return the environment's winning strategy; None if there is none within the limits."""
        limited = self._limited()
        limited.cache, limited.memory_mb = Cache(None), LISTED_MB
        try:
            return None if self.late else limited.counterstrategy(spec).strategy
        except ResourceLimitError:
            return None


def _key_of(spec: Specification) -> bytes:
    return sha256(spec.to_structuredslugs().encode()).digest()


def cooperative(spec: Specification) -> Specification:
    """Return the specification in which the system controls all variables. It is realizable iff
    assumptions and guarantees can be satisfied together."""
    turned = [(c, _COOPERATIVE.get(c.section, c.section)) for c in spec.constraints]
    return replace(
        spec,
        variables=tuple(replace(v, owner=Owner.OUTPUT) for v in spec.variables),
        constraints=tuple(replace(c, section=section) for c, section in turned),
    )


MOST_MOMENTS = 200
"""Maximum number of moments in which the system meets goals in a play."""
MOST_INPUTS = 4096
"""Maximum number of tried inputs in a search for one that leaves no output."""

Nearness = Callable[[Values], float]
Near = Callable[[Constraint], Nearness]
"""A function that returns the distance to a goal. The play prefers the nearer move."""


def anywhere(_goal: Constraint) -> Nearness:
    """Return the constant distance 0 to a goal, for a specification without a map."""
    return lambda _: 0.0


def losing_play(
    whole: Specification, core: Specification, ask: Questions, near: Near = anywhere
) -> LosingPlay | None:
    """Return a play that the system loses although it has to keep only the unrealizable ``core`` of
    the specification ``whole``; None if the limits allow none."""
    strategy = ask.counterstrategy(core)
    if strategy is None:
        return None
    starts = strategy.initial(True)
    if not starts:
        return LosingPlay(PlayEnd.NO_BEGINNING, strategy, pressure=_refused(core))
    arena = _Arena(whole, core, strategy, starts)
    begins = [node for node in starts if arena.begins_well(node)] or starts
    values = strategy.values
    walk = [begins[0]]
    goals = arena.meet_goals(walk)
    nearness: Nearness = near(goals[0]) if goals else (lambda _: 0.0)
    passed = len(walk) - 1  # the last moment at which a goal was met
    while arena.replies[walk[-1]]:
        node = arena.pursue(walk[-1], nearness)
        if node in walk[passed:]:
            cycle = walk[walk.index(node, passed) :]
            if len(cycle) == 1 and (rest := arena.to_an_end(node)):
                walk += rest  # these moves show why the system stays
                break
            walk = walk[: walk.index(node, passed)]
            goal = arena.never_met(cycle)
            shown = tuple(map(values, walk)), tuple(map(values, cycle))
            return LosingPlay(PlayEnd.STARVED, strategy, *shown, goal)
        walk.append(node)
    inputs = arena.pressure(walk[-1])
    return LosingPlay(PlayEnd.STUCK, strategy, tuple(map(values, walk)), pressure=inputs)


class _Arena:
    """A counterstrategy against ``core``. ``replies``: the successors of each node that obey all
    guarantees of ``whole``, or all successors if none does."""

    def __init__(
        self, whole: Specification, core: Specification, strategy: Strategy, starts: Sequence[int]
    ) -> None:
        self._strategy = strategy
        self._automaton = automaton = Automaton(core, strategy, starts)
        self._goals = clauses(core, Section.SYS_LIVENESS)
        self._first = clauses(whole, Section.SYS_INIT)
        self._inputs = [variable.name for variable in core.owned(Owner.INPUT)]
        wrong = 0
        for plane in automaton.violated([c.formula for c in clauses(whole, Section.SYS_TRANS)]):
            wrong |= plane
        after, legal = automaton.edges.after, automaton.edges.without(wrong)
        self.replies = {node: legal[node] or after[node] for node in after}
        self._lasting = _lasting(self.replies)

    def begins_well(self, node: int) -> bool:
        """Return whether a start satisfies all guarantees about the start."""
        values = self._strategy.values(node)
        return all(clause.holds(values, {}) for clause in self._first)

    def meet_goals(self, walk: list[int]) -> list[Constraint]:
        """Extend a walk while it can meet a goal of the round. Return the goals that remain."""
        left = list(self._goals)
        while left and len(walk) < MOST_MOMENTS:
            leg, met = self._nearest(walk[-1], left)
            if met is None:
                break
            walk += leg
            left = [goal for goal in left if goal is not met] or list(self._goals)
        return [goal.constraint for goal in left]

    def _nearest(self, start: int, goals: Sequence[Clause]) -> tuple[Sequence[int], Clause | None]:
        """Return the nodes of a shortest walk after ``start`` to a goal, and the goal or None."""
        values = self._strategy.values

        def steps(node: int) -> list[tuple[int, int]]:
            return [(node, after) for after in self.replies[node]]

        before = reached(steps(start), lambda step: steps(step[1]))
        for a, b in before:
            met = next((goal for goal in goals if goal.holds(values(a), values(b))), None)
            if met is not None:
                return [after for _, after in path_to((a, b), before)], met
        return [], None

    def pursue(self, node: int, near: Nearness) -> int:
        """Return the successor nearest to a goal and, among equally near ones, that with the
        longest possible play."""
        values = self._strategy.values
        return min(self.replies[node], key=lambda n: (near(values(n)), -self._lasting[n]))

    def to_an_end(self, node: int) -> list[int]:
        """Return the nodes after ``node`` on a shortest walk to a node without a move; an empty
        list if there is none."""
        before = reached([node], self.replies.__getitem__)
        end = next((other for other in before if not self.replies[other]), node)
        return list(path_to(end, before))[1:]

    def never_met(self, cycle: Sequence[int]) -> Constraint | None:
        """Return the first goal that a cycle does not meet; None if there is none."""
        values = self._strategy.values
        steps = [(values(a), values(b)) for a, b in zip(cycle, (*cycle[1:], cycle[0]), strict=True)]
        unmet = (goal for goal in self._goals if not any(goal.holds(*step) for step in steps))
        return next((goal.constraint for goal in unmet), None)

    def pressure(self, node: int) -> tuple[tuple[str, int], ...]:
        """Return next inputs that the assumptions allow but that leave the system no output."""
        inputs, outputs = rounds(self._automaton.spec)
        row = inputs.unanswered(outputs, self._automaton.values[node], MOST_INPUTS)
        return tuple(zip(self._inputs, row or (), strict=False))


def _refused(spec: Specification) -> tuple[tuple[str, int], ...]:
    """Return initial inputs that the assumptions allow but that leave the system no output; only
    those inputs that the guarantees mention."""
    inputs, outputs = openings(spec)
    row = inputs.unanswered(outputs, most=MOST_INPUTS)
    promised = clauses(spec, Section.SYS_INIT)
    mentioned = {name for clause in promised for name, _ in clause.places}
    names = [variable.name for variable in spec.owned(Owner.INPUT)]
    return tuple((n, v) for n, v in zip(names, row or (), strict=False) if n in mentioned)


def _lasting(replies: Mapping[int, Sequence[int]]) -> dict[int, float]:
    """Return, for each node, the maximum number of steps of a play from there (or infinity)."""
    before: dict[int, list[int]] = {}
    for node, following in replies.items():
        for after in following:
            before.setdefault(after, []).append(node)
    left = {node: len(after) for node, after in replies.items()}
    lasting = dict.fromkeys(replies, 0.0)
    ended = [node for node, count in left.items() if not count]
    for node in ended:
        for other in before.get(node, ()):
            left[other] -= 1
            lasting[other] = max(lasting[other], lasting[node] + 1)
            if not left[other]:
                ended.append(other)
    return {node: lasting[node] if not left[node] else float("inf") for node in replies}


# Wins of a system that makes assumptions fail.
#
# A strategy may force the environment into a state with no move left, or one where it cannot meet a
# fairness assumption. From there on no guarantee binds the system: it has won and may do nothing.
# Such a win is worth a warning. (Klein, Pnueli: Revisiting synthesis of GR(1) specifications, HVC
# 2010, and Maoz, Ringert: On well-separation of GR(1) specifications, FSE 2016, examine the
# specification; this code examines the strategy in use.) Robots' specifications cannot be won so,
# since no behaviour of the robot makes their assumptions unsatisfiable.


class Cause(StrEnum):
    """Causes of vacuous wins. Each value states its cause in words."""

    NO_BEGINNING = "no initial state satisfies the assumptions, so nothing is guaranteed"
    DEAD_END = "a state can occur in which the assumptions allow no move"
    UNFAIR = "a state can occur from which these assumptions cannot all be met"


class Vacuity(Struct, frozen=True):
    """A vacuous win: the system wins without meeting its goals, since assumptions fail.

    ``path``: the shortest path in the strategy to the node where it wins. ``origins``: those of the
    failed assumptions."""

    cause: Cause
    path: tuple[int, ...] = ()
    origins: tuple[Origin, ...] = ()


def vacuities(strategy: Strategy) -> tuple[Vacuity, ...]:
    """Return the vacuous wins of a strategy, with the shortest paths first.

    The strategy fixes the robot's moves, so the environment plays alone on its automaton. A node is
    won vacuously if no path from it meets all assumptions infinitely often."""
    spec = strategy.specification
    starts = strategy.initial()
    if not starts:
        return (Vacuity(Cause.NO_BEGINNING, origins=_origins(spec, Section.ENV_INIT)),)
    automaton = Automaton(spec, strategy, starts)
    found = []
    stuck = [node for node in automaton.nodes if not strategy.transitions[node]]
    if stuck:
        steps = _origins(spec, Section.ENV_TRANS)
        found.append(Vacuity(Cause.DEAD_END, automaton.path(stuck[0]), steps))
    parts = cyclic_parts(automaton.edges.after)
    fair = clauses(spec, Section.ENV_LIVENESS)
    lacking = _lacking(automaton, parts, len(fair))
    good = {node for node, part in parts.items() if not lacking[part]}
    hopeless = _cut_off(automaton, good | set(stuck))
    if hopeless:
        first = next(node for node in automaton.nodes if node in hopeless)
        within = reached([first], strategy.transitions.__getitem__)
        ahead = [lacking[part] for node, part in parts.items() if node in within]
        never = [k for k in range(len(fair)) if all(k in missing for missing in ahead)]
        failing = dict.fromkeys(fair[k].constraint.origin for k in never or range(len(fair)))
        path = automaton.path(first)
        found.append(Vacuity(Cause.UNFAIR, path, tuple(failing)))
    return tuple(sorted(found, key=lambda vacuity: len(vacuity.path)))


def _origins(spec: Specification, *sections: Section) -> tuple[Origin, ...]:
    found = (c.origin for section in sections for c in spec.section(section))
    return tuple(dict.fromkeys(found))


def _lacking(automaton: Automaton, parts: dict[int, int], count: int) -> dict[int, set[int]]:
    """Return, for each strongly connected component, the indices of the assumptions that no
    transition within it meets."""
    lacking = {part: set(range(count)) for part in set(parts.values())}
    formulas = [clause.formula for clause in clauses(automaton.spec, Section.ENV_LIVENESS)]
    for k, unmet in enumerate(automaton.violated(formulas)):
        missing = automaton.edges.flags(unmet)
        for index, (source, target) in enumerate(automaton.edges):
            part = parts.get(source)
            if not missing[index] and part is not None and part == parts.get(target):
                lacking[part].discard(k)
    return lacking


def _cut_off(automaton: Automaton, good: set[int]) -> set[int]:
    """Return the nodes from which no path leads to a ``good`` node."""
    before: dict[int, list[int]] = {}
    for source, target in automaton.edges:
        before.setdefault(target, []).append(source)
    return set(automaton.nodes) - reached(good, lambda node: before.get(node, ())).keys()
