"""Writing traces by hand: a script follows the robots so that a line needs only what is new.

It follows docs/trace.md and does not import safenav. Scripts are not checked; they may be wrong.
"""

import copy
import json
from collections.abc import Callable, Mapping
from typing import Any, Self

Line = dict[str, Any]
NOTES = {"late", "backtrack", "belief", "resumed"}
WAYS = {"north": (-1, 0), "east": (0, 1), "south": (1, 0), "west": (0, -1)}


ROOM = "######\n#....#\n#....#\n######"
"""Free regions: 7 to 10 above 13 to 16."""
CORRIDOR = "#######\n#.....#\n#######"
"""Free regions: 8 to 12."""


def robot(
    layer: str, capabilities: list[str], start: int, objective: Line, heading: str | None = None
) -> Line:
    return {
        "model": "test",
        "mobility": "heading" if heading else "free",
        "layer": layer,
        "capabilities": capabilities,
        "start": start,
        "heading": heading,
        "objective": objective,
    }


def obstacle(
    kind: str,
    region: int,
    action: str,
    at: list[int],
    blocks: list[str],
    traversable: bool | None = None,
) -> Line:
    return {
        "type": kind,
        "name": f"{kind}@{region}",
        "region": region,
        "needs": [{"action": action, "regions": at}],
        "blocks": blocks,
        "traversable": traversable,
    }


def closure(never: list[str], **robots: tuple[list[int], bool]) -> Line:
    """Return a closure proof: for each robot its reachable regions, and whether it can continue."""
    return {
        "kind": "closure",
        "resolved": [],
        "never": never,
        "robots": {
            name: {"poses": [[region, None] for region in regions], "live": live}
            for name, (regions, live) in robots.items()
        },
    }


class Script:
    """A trace in the making: ``lines`` are its lines as objects."""

    def __init__(
        self,
        grid: str,
        robots: dict[str, Line],
        obstacles: list[Line],
        rounds: int = 1,
        ticks: int = 50,
    ) -> None:
        rows = grid.split()
        self.cols = len(rows[0])
        self.position = {name: entry["start"] for name, entry in robots.items()}
        self.heading = {name: entry["heading"] for name, entry in robots.items()}
        self.objectives = {name: entry["objective"] for name, entry in robots.items()}
        self.stack: list[tuple[Line, dict[str, Line]]] = []
        self.tick = 0
        self.obstacles = {entry["name"]: entry for entry in obstacles}
        scenario = {
            "name": "test",
            "map": {"rows": len(rows), "cols": self.cols, "grid": rows},
            "robots": robots,
            "obstacles": obstacles,
            "until": {"rounds": rounds},
            "limits": {"ticks": ticks},
            "seed": 0,
            "coordination": "resynthesis",
        }
        self.lines: list[Line] = [
            {"type": "header", "trace": 4, "safenav": "0.1.0", "scenario": scenario}
        ]
        self.synthesize("initial", *robots)

    def add(self, kind: str, **fields: Any) -> Self:
        note = {"note": True} if kind in NOTES else {}
        self.lines.append({"type": kind, "tick": self.tick, **note, **copy.deepcopy(fields)})
        return self

    def synthesize(
        self, reason: str, *robots: str, verdict: str = "realizable", objective: Line | None = None
    ) -> Self:
        good = verdict == "realizable"
        for name in robots:
            self.add(
                "synthesis",
                robot=name,
                reason=reason,
                verdict=verdict,
                seconds=0.01,
                states=20 if good else None,
                cached=False,
                verified=True if good else None,
                spec=f"{len(self.lines):064x}",
                strategy="0" * 64 if good else None,
                objective=objective or self.objectives[name],
                assumptions=[],
            )
        return self

    def next_tick(self) -> Self:
        self.tick += 1
        return self

    def move(self, name: str, to: int | None = None) -> Self:
        """A step to a neighbour, or (without one) a stay."""
        origin = self.position[name]
        to = origin if to is None else to
        step = (to // self.cols - origin // self.cols, to % self.cols - origin % self.cols)
        for way, delta in WAYS.items():
            if step == delta and self.heading[name] is not None:
                self.heading[name] = way
        self.position[name] = to
        return self.add("move", robot=name, **{"from": origin}, to=to, heading=self.heading[name])

    def step(self, name: str, to: int | None = None) -> Self:
        """A move, or a stay, that a joint plan decided."""
        self.move(name, to)
        self.lines[-1]["by"] = "plan"
        return self

    def set_out(self, name: str, toward: int) -> Self:
        """Record a tick of a step of several ticks: the robot is still here, in transit."""
        here = self.position[name]
        heading = self.heading[name]
        return self.add(
            "move", robot=name, **{"from": here}, to=here, heading=heading, toward=toward
        )

    def believe(self, name: str, of: str, seen: bool, *regions: int) -> Self:
        return self.add("belief", robot=name, of=of, seen=seen, regions=list(regions))

    def meet(self, name: str, what: str, instead: int | None = None) -> Self:
        """Violation, backtrack and the move that follows."""
        entry = self.obstacles[what]
        here = self.position[name]
        to = here if instead is None else instead
        self.add(
            "violation",
            robot=name,
            at=here,
            proposed=entry["region"],
            obstacle=what,
            action=entry["needs"][0]["action"],
        )
        return self.add("backtrack", robot=name, to=to).move(name, instead)

    def request(
        self, requester: str | None, what: str, bids: Mapping[str, int | None], helper: str | None
    ) -> Self:
        at = self.obstacles[what]["needs"][0]["regions"]
        why = {"obstacle": what, "requester": requester, "helpers": [helper] if helper else []}
        return self.add("request", **why, bids=bids, regions=at)

    def push(
        self, requester: str | None, what: str | None, helper: str | None, **changed: Line
    ) -> Self:
        why = {"obstacle": what, "requester": requester, "helpers": [helper] if helper else []}
        self.stack.append((why, dict(self.objectives)))
        self.objectives |= changed
        return self.add("push", depth=len(self.stack), objectives=self.objectives, **why)

    def resolve(self, name: str, what: str, requested: bool = True) -> Self:
        return self.add(
            "resolved",
            obstacle=what,
            robot=name,
            at=self.position[name],
            requested=requested,
            traversable=self.obstacles[what]["traversable"],
        )

    def pop(self, what: str | None = None, **changed: Line) -> Self:
        """Drop an entry, by default the top one with what was in force before it."""
        found = [k for k, (why, _) in enumerate(self.stack) if what in (None, why["obstacle"])]
        why, before = self.stack.pop(found[-1])
        self.objectives = self.objectives | changed if changed else before
        return self.add("pop", depth=len(self.stack), objectives=self.objectives, **why)

    def block(self, what: str, reason: str, proof: Line | None = None, *robots: str) -> Self:
        more = {} if proof is None else {"proof": proof}
        return self.add("blocked", obstacle=what, robots=list(robots), reason=reason, **more)

    def goal(self, name: str, index: int, completed: int) -> Self:
        at = self.position[name]
        return self.add("goal", robot=name, goal=index, region=at, round=completed)

    def end(self, outcome: str, rounds: dict[str, int], **more: Any) -> list[Line]:
        """The outcome; returns all lines."""
        self.add(
            "outcome",
            outcome=outcome,
            explanation="",
            rounds=rounds,
            ticks=self.tick,
            seconds=0.1,
            syntheses=sum(line["type"] == "synthesis" for line in self.lines),
            synthesis_seconds=0.05,
            **more,
        )
        return self.lines


Mutation = Callable[[list[Line]], None]


def find(lines: list[Line], kind: str, nth: int = 0, **fields: Any) -> int:
    """Return the index of the nth line of a kind with these fields (``origin``: ``from``)."""
    wanted = {"from" if key == "origin" else key: value for key, value in fields.items()}
    found = [
        index
        for index, line in enumerate(lines)
        if line["type"] == kind and all(line.get(k) == v for k, v in wanted.items())
    ]
    return found[nth]


def edit(kind: str, where: Line, /, **changes: Any) -> Mutation:
    """Change fields of the first line that matches."""

    def mutate(lines: list[Line]) -> None:
        renamed = {"from" if key == "origin" else key: value for key, value in changes.items()}
        lines[find(lines, kind, **where)].update(renamed)

    return mutate


def drop(kind: str, **where: Any) -> Mutation:
    def mutate(lines: list[Line]) -> None:
        del lines[find(lines, kind, **where)]

    return mutate


def insert_after(kind: str, where: Line, /, **line: Any) -> Mutation:
    """Put a copy of a line, with changes, behind it (or a new line if it has a ``type``)."""

    def mutate(lines: list[Line]) -> None:
        index = find(lines, kind, **where)
        base = {} if "type" in line else copy.deepcopy(lines[index])
        lines.insert(index + 1, {"tick": lines[index].get("tick", 0), **base, **line})

    return mutate


def scenario(*path: Any, to: Any) -> Mutation:
    """Set something in the header's scenario."""

    def mutate(lines: list[Line]) -> None:
        place = lines[0]["scenario"]
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = to

    return mutate


def both(*mutations: Mutation) -> Mutation:
    def mutate(lines: list[Line]) -> None:
        for mutation in mutations:
            mutation(lines)

    return mutate


def text(lines: list[Line]) -> list[str]:
    return [json.dumps(line) for line in lines]
