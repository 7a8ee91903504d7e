"""A robot's beliefs about other robots, and their formulas: an input ``at_NAME`` for each.

The paper keeps this belief abstraction from its predecessor (Bharadwaj, Dimitrova, Topcu: Synthesis
of surveillance strategies via belief abstraction, CDC 2018). From a known region, and from each
region of the believed cells, the other robot may stay or step to a neighbour. In a live run it may
be anywhere within reach, since nothing bounds its steps between two observations. A successor in
sight remains a region; all successors out of sight form one belief: the set of cells that contain
one. This module defines the update of knowledge once, for the specification and the runtime, so a
strategy receives exactly the observations for which it was synthesized. As in the game, first the
other robot moves; then this robot observes from its region and moves.

Values of ``at_NAME`` below the number of regions are regions where the robot sees the other robot;
greater values are the beliefs that can occur. So the game is as fine as the map near the robot and
as coarse as the partition elsewhere. There are constraints for each own region (with the regions in
sight) and each belief, never for each pair of positions. Impossible pairs remain unconstrained
where that shortens the text. See docs/tracking.md.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from functools import lru_cache

from msgspec import Struct

from safenav.data import cached_method
from safenav.errors import UsageError
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Variable,
    headings,
    step_formula,
    wrapping,
)
from safenav.spec.task import Observed, Task
from safenav.world.map import Cells, Heading, Region, RegionMap, coarsened, rooms
from safenav.world.poses import Mask, Mobility, bits, plain_graph, region_mask

Belief = frozenset[int]
"""The cells that may contain a robot out of sight; never empty."""

Knowledge = Region | Belief
"""The region where another robot is seen, or the cells that may contain it."""


class Prospect(Struct, frozen=True):
    """The possible knowledge after the next observation: one of the regions in sight (``seen``) or,
    if the other robot is out of sight, the ``belief`` (None: it cannot be out of sight)."""

    seen: frozenset[Region]
    belief: Belief | None


class Outlook(Struct, frozen=True):
    """The prospects of a state of knowledge from all own regions. ``reach``: where the other robot
    may move; ``beliefs``: each belief (or None) with the own regions that lead to it."""

    reach: Mask
    beliefs: tuple[tuple[Belief | None, Mask], ...]


class Tracker:
    """The tracking of other robots on a map, by the cells of a partition and the robot's visibility
    (``radius`` and ``closed`` as in ``Visibility``). ``live``: whether other robots make any number
    of steps between two observations, not at most one."""

    def __init__(
        self,
        world: RegionMap,
        cells: Cells,
        radius: float | None,
        closed: frozenset[Region] = frozenset(),
        live: bool = False,
    ) -> None:
        from safenav.world.sight import visible_from  # imported here: few robots have beliefs

        self.world = world
        self.cells = cells
        self.visibility = visible_from(world, radius, closed)
        self.live = live
        self._graph = plain_graph(world, Mobility.FREE)
        self._free = self._graph.free_regions
        self._masks = tuple(map(region_mask, cells))

    def possible(self, knowledge: Knowledge) -> frozenset[Region]:
        """Return the regions where the other robot may be, given this robot's knowledge."""
        if isinstance(knowledge, frozenset):
            return frozenset().union(*(self.cells[cell] for cell in knowledge))
        return frozenset({knowledge})

    def update(self, own: Region, knowledge: Knowledge) -> Prospect:
        """Return the possible knowledge after the other robot's next move and an observation from
        region ``own``."""
        outlook = self.outlook(knowledge)
        seen = frozenset(bits(outlook.reach & self.visibility.mask(own)))
        belief = next((b for b, owns in outlook.beliefs if owns >> own & 1), None)
        return Prospect(seen, belief)

    def look(self, own: Region, other: Region, known: Knowledge) -> Knowledge:
        """Return the knowledge after an observation from region ``own`` while the other robot is in
        region ``other`` (which only decides whether it is seen). The belief is all cells if it is
        out of sight although all regions that it can have reached are in sight."""
        if self.visibility.mask(own) >> other & 1:
            return other
        belief = self.update(own, known).belief
        return frozenset(range(len(self.cells))) if belief is None else belief

    @cached_method
    def outlook(self, knowledge: Knowledge) -> Outlook:
        """Return the prospects of a state of knowledge from all free regions."""
        return self._look_ahead(self.reach(region_mask(self.possible(knowledge))))

    def spread(self, regions: Mask, within: Mask | None = None) -> Mask:
        """Return the regions ``within`` (default: free) at most one step away from ``regions``."""
        around = regions | self._graph.forward(regions)
        return around & (self._free if within is None else within)

    def reach(self, regions: Mask) -> Mask:
        """Return the regions where a robot in one of ``regions`` may be at the next observation."""
        free = self._free
        return self._graph.closure(regions & free, free) if self.live else self.spread(regions)

    @cached_method
    def _look_ahead(self, reach: Mask) -> Outlook:
        """Return the outlook for ``reach``. In a live run, many states of knowledge share one."""
        groups: list[tuple[Belief, Mask]] = [(frozenset(), self._free)]
        for cell, regions in enumerate(self._masks):
            if not reach & regions:
                continue
            overseen = self._free  # regions with all reached regions of the cell in sight
            for region in bits(reach & regions):
                overseen &= self.visibility.mask(region)
                if not overseen:
                    break
            groups = [
                part
                for belief, owns in groups
                for part in ((belief, owns & overseen), (belief | {cell}, owns & ~overseen))
                if part[1]
            ]
        return Outlook(reach, tuple((belief or None, owns) for belief, owns in groups))


watch = lru_cache(maxsize=64)(Tracker)
"""A tracker, cached by its arguments."""


class TooManyBeliefsError(ValueError):
    """Too many beliefs for a specification in reasonable time."""


def occurring(
    watch: Tracker, own: Region, blocked: frozenset[Region], knowledge: Knowledge, most: int
) -> Mapping[Knowledge, Mask]:
    """Return each possible state of knowledge with the robot's own regions in which it may occur.

    The robot starts in region ``own`` with ``knowledge`` and steps freely except into ``blocked``
    regions. Raises TooManyBeliefsError if there are more than ``most`` beliefs.
    """
    floor = region_mask(watch.world.free) & ~region_mask(blocked) | 1 << own
    found: dict[Knowledge, Mask] = {knowledge: 1 << own}
    fresh: dict[Knowledge, Mask] = dict(found)
    queue: deque[Knowledge] = deque(found)
    beliefs = int(isinstance(knowledge, frozenset))
    while queue:
        known = queue.popleft()
        for after, owns in _following(watch, known, fresh.pop(known)):
            new = watch.spread(owns, floor) & ~found.get(after, 0)
            if not new:
                continue
            if after not in found and isinstance(after, frozenset):
                beliefs += 1
                if beliefs > most:
                    raise TooManyBeliefsError(
                        f"more than {most} beliefs occur with {len(watch.cells)} cells"
                    )
            found[after] = found.get(after, 0) | new
            if after not in fresh:
                queue.append(after)
            fresh[after] = fresh.get(after, 0) | new
    return found


def _following(
    watch: Tracker, knowledge: Knowledge, owns: Mask
) -> Iterator[tuple[Knowledge, Mask]]:
    """Yield each possible next state of knowledge with the robot's own regions that lead to it."""
    outlook = watch.outlook(knowledge)
    for region in bits(outlook.reach):
        seers = owns & watch.visibility.mask(region)
        if seers:
            yield region, seers
    for belief, blind in outlook.beliefs:
        if belief is not None and owns & blind:
            yield belief, owns & blind


SOURCE = "safenav: beliefs about other robots"
MOST_CELLS = 6
"""Maximum number of cells of an automatic partition. If there are more, the smallest are joined
(docs/tracking.md)."""
MOST_BELIEFS = 4000
"""Maximum number of beliefs of a specification."""


class Model(Struct, frozen=True):
    """The possible knowledge of one other robot, and its encoding as the values of an input."""

    other: Observed
    watch: Tracker
    beliefs: tuple[Belief, ...]
    owns: Mapping[Knowledge, Mask]

    @property
    def size(self) -> int:
        """The number of regions, which is also the value of the first belief."""
        return self.watch.world.size

    def number(self, knowledge: Knowledge) -> int:
        """Return the input's value for some knowledge (out of its range if that is impossible)."""
        if not isinstance(knowledge, frozenset):
            return knowledge
        known = knowledge in self.beliefs
        return self.size + (self.beliefs.index(knowledge) if known else len(self.beliefs))


def automatic(world: RegionMap) -> Cells:
    """Return the default cells of beliefs: the rooms of the map."""
    return coarsened(rooms(world), MOST_CELLS, world)


def watch_for(task: Task, world: RegionMap) -> Tracker:
    """Return the tracker of a task's robot. It uses the task's cells (default: the rooms of the
    map) and the robot's vision, which the ``closed`` regions block."""
    return watch(
        world, task.partition or automatic(world), task.robot.model.vision, task.closed, task.live
    )


def known_of(other: Observed) -> Knowledge:
    """Return the initial knowledge of an observed robot."""
    return other.region if other.belief is None else other.belief


def models(task: Task, world: RegionMap) -> tuple[Model, ...]:
    """Return the possible knowledge of each observed robot.

    Raises UsageError if the partition leads to too many beliefs.
    """
    if not task.observed:
        return ()
    blocked = frozenset(known.region for known in task.blocked)
    seen_by, own = watch_for(task, world), task.pose.region
    try:
        return tuple(_model(seen_by, own, blocked, other) for other in task.observed)
    except TooManyBeliefsError as error:
        raise UsageError(
            f"{task.robot.name}: {error}; give a 'partition' of larger tiles"
        ) from error


@lru_cache(maxsize=256)
def _model(seen_by: Tracker, own: Region, blocked: frozenset[Region], other: Observed) -> Model:
    found = occurring(seen_by, own, blocked, known_of(other), MOST_BELIEFS)
    beliefs = [known for known in found if isinstance(known, frozenset)]
    return Model(other, seen_by, tuple(sorted(beliefs, key=lambda b: (len(b), sorted(b)))), found)


def inputs(task: Task, world: RegionMap) -> tuple[Variable, ...]:
    found = []
    for model in models(task, world):
        other = model.other
        note = f"region of {other.name}, as seen"
        if model.beliefs:
            note += f"; values from {model.size}: out of sight, in one of these cells: "
            note += ", ".join("+".join(map(str, sorted(belief))) for belief in model.beliefs)
        bounds = (0, world.size - 1 + len(model.beliefs))
        found.append(Variable(other.variable, Owner.INPUT, bounds, note))
    return tuple(found)


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions: other robots make single steps (live: any number); their regions are
    known in sight, their beliefs out of sight."""
    for model in models(task, world):
        item, name = f"robots.{model.other.name}", model.other.variable
        begin = Origin(f"{item}.start", f"initial knowledge of {model.other.name}")
        yield Constraint(Section.ENV_INIT, f"{name} = {model.number(known_of(model.other))}", begin)
        yield from _steps(model, item)
        yield from _sight(model, item)
        yield from _vanishing(model, item)
        yield from _believing(model, item)


def observe(task: Task, world: RegionMap, known: Mapping[str, Knowledge]) -> dict[str, int]:
    """Return the inputs for a robot's knowledge of other robots (``known``, by their names)."""
    return {m.other.variable: m.number(known[m.other.name]) for m in models(task, world)}


def _steps(model: Model, item: str) -> Iterator[Constraint]:
    """Yield the constraints on moves between regions in sight: a single step (live: any number)."""
    world, name, size = model.watch.world, model.other.variable, model.size
    if model.watch.live:
        origin = Origin(item, "while in sight: move to any region that it can reach", SOURCE)
        pieces = {model.watch.reach(1 << region) for region in _seen_regions(model)}
        for piece in sorted(pieces - {region_mask(world.free)}):
            there = f"{name}' < {size} -> {within(name, piece, prime=True)}"
            yield Constraint(Section.ENV_TRANS, f"{within(name, piece)} & {there}", origin)
        return
    origin = Origin(item, "while in sight: stay, or step to a neighbouring region", SOURCE)
    steps = [f"{name}' = {name}", *(step_formula(name, h, world) for h in headings(world))]
    seen = f"{name} < {size} & {name}' < {size}"
    yield Constraint(Section.ENV_TRANS, f"{seen} -> {' | '.join(steps)}", origin)
    for heading in (Heading.EAST, Heading.WEST):
        edge = wrapping(heading, world)
        if edge and world.cols > 1:
            origin = Origin(item, f"no step {heading.label} from the map's edge", SOURCE)
            step = step_formula(name, heading, world)
            where = within(name, region_mask(tuple(edge)))
            yield Constraint(Section.ENV_TRANS, f"{where} -> !({step})", origin)


def _sight(model: Model, item: str) -> Iterator[Constraint]:
    """Yield the constraints on observations: the other robot is seen only in regions in sight."""
    name, size, visibility = model.other.variable, model.size, model.watch.visibility
    origin = Origin(item, f"{model.other.name} is observed only while in sight", SOURCE)
    alike: dict[Mask, Mask] = {}
    for own in bits(_own_regions(model)):
        sight = visibility.mask(own)
        alike[sight] = alike.get(sight, 0) | 1 << own
    for sight, owns in alike.items():
        formula = (
            f"{within('region', owns)} & {name}' < {size} -> {within(name, sight, prime=True)}"
        )
        yield Constraint(Section.ENV_TRANS, formula, origin)


def _vanishing(model: Model, item: str) -> Iterator[Constraint]:
    """Yield the constraints on disappearance: from a known region the other robot leaves sight only
    by a step (live: any number); the belief is then the cells that such steps reach."""
    name, size = model.other.variable, model.size
    everywhere = (1 << size) - 1
    stays: dict[Region, Mask] = {}
    may_vanish: dict[Region, Mask] = {}
    plain: dict[Belief, Mask] = {}
    several: list[tuple[Region, Belief, Mask, Mask]] = []
    for region in _seen_regions(model):
        owns = model.owns[region]
        vanish = {b: owns & blind for b, blind in model.watch.outlook(region).beliefs if b}
        vanish = {b: blind for b, blind in vanish.items() if blind}
        in_sight = owns & ~sum(vanish.values())
        for own in bits(in_sight):
            stays[own] = stays.get(own, 0) | 1 << region
        for own in bits(owns & ~in_sight):
            may_vanish[own] = may_vanish.get(own, 0) | 1 << region
        if len(vanish) == 1:
            belief = next(iter(vanish))
            plain[belief] = plain.get(belief, 0) | 1 << region
        open_ = everywhere & ~owns
        several += [
            (region, belief, blind, blind | open_ | in_sight)
            for belief, blind in vanish.items()
            if len(vanish) > 1
        ]
    origin = Origin(item, f"{model.other.name} vanishes only by a step out of sight", SOURCE)
    for own, regions in sorted(stays.items()):
        where = within(name, regions, everywhere & ~may_vanish.get(own, 0))
        yield Constraint(Section.ENV_TRANS, f"region = {own} & {where} -> {name}' < {size}", origin)
    origin = Origin(item, f"out of sight, {model.other.name} is believed where it can be", SOURCE)
    never = everywhere & ~region_mask(_seen_regions(model))
    for belief, regions in plain.items():
        after = f"{name}' = {model.number(belief)}"
        where = within(name, regions, never)
        formula = f"{where} & {name}' >= {size} -> {after}"
        yield Constraint(Section.ENV_TRANS, formula, origin)
    for region, belief, owns, may in several:
        after = f"{name}' < {size} | {name}' = {model.number(belief)}"
        formula = f"{name} = {region} & {within('region', owns, may)} -> {after}"
        yield Constraint(Section.ENV_TRANS, formula, origin)


def _believing(model: Model, item: str) -> Iterator[Constraint]:
    """Yield the constraints on beliefs: from a believed cell the other robot may appear where it
    can have moved, or stay out of sight. A belief omits cells whose reachable regions are all in
    sight."""
    name, size = model.other.variable, model.size
    wall = region_mask(tuple(model.watch.world.walls))
    for belief in model.beliefs:
        outlook, owns = model.watch.outlook(belief), model.owns[belief]
        cells = "+".join(map(str, sorted(belief)))
        origin = Origin(item, f"while {model.other.name} is believed in {cells}", SOURCE)
        source = f"{name} = {model.number(belief)}"
        reach = within(name, outlook.reach, outlook.reach | wall, prime=True)
        yield Constraint(Section.ENV_TRANS, f"{source} & {name}' < {size} -> {reach}", origin)
        open_ = (1 << size) - 1 & ~owns
        found = [(after, owns & blind) for after, blind in outlook.beliefs if owns & blind]
        for after, blind in found:
            then = f"{name}' < {size}"
            if after is not None:
                then += f" | {name}' = {model.number(after)}"
            formula = f"{source} -> {then}"
            if len(found) > 1:
                formula = f"{source} & {within('region', blind, blind | open_)} -> {then}"
            yield Constraint(Section.ENV_TRANS, formula, origin)


def _own_regions(model: Model) -> Mask:
    """Return the possible regions of this robot when another robot moves."""
    owns = 0
    for regions in model.owns.values():
        owns |= regions
    return owns


def _seen_regions(model: Model) -> tuple[Region, ...]:
    return tuple(sorted(k for k in model.owns if not isinstance(k, frozenset)))


def within(variable: str, must: Mask, may: Mask = 0, *, prime: bool = False) -> str:
    """Return a formula, which binds like an atom: the ``variable`` has one of the values in
    ``must``. It may include values in ``may`` where that is shorter."""
    name = variable + "'" * prime
    atoms = []
    for first, last in _runs(must, may):
        if first == last:
            atoms.append(f"{name} = {first}")
        else:
            atoms.append(f"{name} >= {first} & {name} <= {last}")
    if len(atoms) == 1 and "&" not in atoms[0]:
        return atoms[0]
    return "(" + " | ".join(atoms) + ")"


def _runs(must: Mask, may: Mask) -> Iterator[tuple[int, int]]:
    """Yield runs of consecutive values that together cover ``must`` and end with its values."""
    first = last = -1
    for value in bits(must):
        gap = (1 << value) - (1 << last + 1)
        if first >= 0 and not gap & ~may:
            last = value
            continue
        if first >= 0:
            yield first, last
        first = last = value
    if first >= 0:
        yield first, last
