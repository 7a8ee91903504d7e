"""Proofs that ignore collisions: closure tables, and trees where irreversible choices matter."""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from safenav.solve.solve import Sets, Step, options
from safenav.team.floor import Stages
from safenav.trace import proofs
from safenav.world.poses import Mask, PoseGraph, bits


class Closure(Struct, frozen=True):
    """All that the team can do. ``never``: the gates that are never resolved; ``stuck``: those of
    them whose next need can never be met; ``reach``, ``live``: of each robot once all others are
    resolved."""

    resolved: tuple[int, ...]
    never: tuple[int, ...]
    stuck: tuple[int, ...]
    reach: tuple[Mask, ...]
    live: tuple[bool, ...]
    left: Stages


class Refuted(Struct, frozen=True):
    """A step that could come next, and why it does not help."""

    step: Step
    lossless: bool
    because: Refutation


Refutation = Closure | tuple[Refuted, ...]


def closure_of(now: Sets) -> Closure:
    """The least fixpoint: a need can be met if enough able robots reach its regions once all that
    can be resolved is resolved."""
    floor, given, grown = now.floor, now.stages, True
    while grown:
        grown = False
        for g in floor.open(now.stages):
            if _enough(g, now, given):
                now, grown = replace(now, stages=floor.advanced(g, now.stages)), True
    never = floor.open(now.stages)
    return Closure(
        tuple(g for g in floor.open(given) if g not in never),
        never,
        tuple(g for g in never if now.stages[g].need == given[g].need),
        tuple(now.reach(i, poses) for i, poses in enumerate(now.sets)),
        tuple(i not in floor.robots or now.alive(i) for i in range(len(now.sets))),
        now.stages,
    )


def _enough(g: int, now: Sets, given: Stages) -> bool:
    """Whether enough robots reach the regions of the next need, and those of the needs before it
    that the same robots must meet."""
    floor, stages = now.floor, now.stages
    needs, number = floor.gate(g).needs, stages[g].need
    begin = number
    while begin > given[g].need and needs[begin].same:
        begin -= 1
    able = []
    for i in floor.able(g, stages):
        there = [bool(now.spots(i, need.regions)) for need in needs[begin : number + 1]]
        if begin == given[g].need < number and i in given[g].done:
            there[0] = True
        elif i in floor.gate(g).strays[begin]:
            continue
        able += [i] if all(there) else []
    return len(able) >= floor.missing(g, stages)


def refute(now: Sets) -> Refutation:
    """The proof that SOLVE fails there."""
    closure = closure_of(now)
    if not all(closure.live):
        return closure
    steps = options(now, None, {}, every=True)
    safe = [s for s in steps if not now.floor.commits(s.g, now.stages) and _loses_nothing(s, now)]
    return tuple(Refuted(step, bool(safe), refute(now.after(step))) for step in safe[:1] or steps)


def _loses_nothing(step: Step, now: Sets) -> bool:
    pairs = zip(step.group, step.at, strict=True)
    return all(not now.reach(i, now.sets[i]) & ~now.reach(i, at) for i, at in pairs)


# In the words of a trace.


def stated(now: Sets, found: Refutation, given_up: tuple[str, ...] = ()) -> proofs.Proof:
    floor = now.floor
    name = [floor.gate(g).name for g in range(len(floor.gates))]
    if isinstance(found, Closure):
        robots = zip(floor.team.members, floor.graphs, found.reach, found.live, strict=True)
        reach = {m.name: proofs.Reach(places(graph, at), live) for m, graph, at, live in robots}
        never = (*(name[g] for g in found.never), *given_up)
        return proofs.Closure(tuple(name[g] for g in found.resolved), never, reach)
    choices = []
    for each in found:
        group = tuple(floor.team.members[i].name for i in each.step.group)
        option = proofs.Option(name[each.step.g], each.step.need, group, each.lossless)
        choices.append(proofs.Choice(option, stated(now, each.because, given_up)))
    return proofs.Tree(tuple(choices))


def places(graph: PoseGraph, poses: Mask) -> tuple[tuple[int, str | None], ...]:
    return tuple(
        sorted((graph.pose(p).place for p in bits(poses)), key=lambda e: (e[0], e[1] or ""))
    )
