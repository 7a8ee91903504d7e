"""A replay as the compact data that the page carries (its types: front/src/run/run.ts).

Values that change now and then are lists of [tick, value...]; ways are lists of regions and a
letter for each heading: a thousand ticks of a robot take about five kilobytes.
A set of regions is written once, as a list of runs of consecutive regions; of each run the gap
before it and its length: ``14,3,7,2`` (front/src/run/sets.ts).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from msgspec import Struct, field
from msgspec.structs import asdict

from safenav.report.picture.glyphs import EVENT_MARKS, NOSE, STATUS_MARKS
from safenav.report.picture.pictograms import CHARGER, obstacle_pictogram, robot_pictogram
from safenav.report.replay import timeline
from safenav.report.replay.perception import SightCache, viewers
from safenav.scenario.objective import Objective, target_regions
from safenav.trace.looks import looks
from safenav.trace.vocabulary import OPERATOR_ACTION
from safenav.trace.wording import objective_words
from safenav.trace.words import seconds_words
from safenav.world.map import Region, RegionMap


class RegionSets(Struct):
    """Collects sets; ``index`` is the index of one in ``texts``."""

    texts: list[str] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def index(self, regions: Iterable[Region]) -> int:
        """Return the index of the set with these regions, which must ascend."""
        text = written(regions)
        if text not in self._places:
            self._places[text] = len(self.texts)
            self.texts.append(text)
        return self._places[text]


def written(regions: Iterable[Region]) -> str:
    """Return regions, ascending, as gaps and lengths of runs."""
    numbers: list[int] = []
    end = 0
    for region in regions:
        if numbers and region == end:
            numbers[-1] += 1
        else:
            numbers += [region - end, 1]
        end = region + 1
    return ",".join(map(str, numbers))


def encoded(replay: timeline.Replay, source: str) -> dict[str, Any]:
    """Return the data of the page. ``source`` is the name of the trace, for its reader."""
    ending = replay.ending
    index = {track.name: i for i, track in enumerate(replay.robots)}
    style = looks([track.name for track in replay.robots])
    sets = RegionSets()
    watched = {viewer: _view(replay, viewer, index, sets) for viewer in viewers(replay)}
    return {
        "name": replay.name,
        "source": source,
        "version": replay.version,
        "rows": replay.map.rows,
        "cols": replay.map.cols,
        "grid": replay.map.grid_rows(),
        "names": {region: name for name, region in reversed([*replay.map.names.items()])},
        "areas": {name: sorted(area) for name, area in replay.map.areas.items()},
        "chargers": list(replay.chargers),
        "charger": CHARGER,
        "last": replay.last,
        "times": replay.times and [round(time, 3) for time in replay.times],
        "within": replay.within,
        "opens": replay.last if replay.failed else 0,
        "robots": [
            {**_robot(replay, track), "look": asdict(look), "view": watched.get(track.name)}
            for track, look in zip(replay.robots, style, strict=True)
        ],
        "obstacles": [
            {
                **obstacle_data(hidden, replay.map),
                "status": _changes(replay.statuses[hidden.name], status_data),
                "met": _changes(replay.met.get(hidden.name, timeline.Changes.of(0, ())), met_data),
                "carried": _changes(
                    replay.loads.get(hidden.name, timeline.Changes.of((), ())),
                    lambda robots: carriers_data(robots, index),
                ),
            }
            for hidden in replay.hidden
        ],
        "stack": _changes(replay.stack, lambda frames: stack_data(frames, replay.map)),
        "sets": sets.texts,
        "events": [event_data(event, index) for event in replay.events],
        "deadlines": [slack_data(slack) for slack in replay.deadlines],
        "ending": ending
        and {
            "outcome": ending.outcome,
            "explanation": ending.explanation,
            "seconds": seconds_words(ending.seconds),
            "syntheses": ending.syntheses,
            "synthesisSeconds": seconds_words(ending.synthesis_seconds),
        },
        "nose": NOSE,
        "marks": {
            "status": {
                status.value: {"path": mark.path, "meaning": status.meaning}
                for status, mark in STATUS_MARKS.items()
            },
            "event": {kind.value: mark.path for kind, mark in EVENT_MARKS.items()},
        },
    }


def obstacle_data(hidden: timeline.Hidden, world: RegionMap) -> dict[str, Any]:
    return {
        "name": hidden.name,
        "label": hidden.label(world),
        "type": hidden.type,
        "shape": obstacle_pictogram(hidden.type),
        "region": hidden.region,
        "action": hidden.actions[0],
        "needs": [open_need(action) for action in hidden.actions],
        "blocks": hidden.blocks,
        "since": hidden.since,
    }


def open_need(action: str) -> str:
    """A need of an obstacle in words."""
    return "an operator" if action == OPERATOR_ACTION else f"'{action}'"


def event_data(event: timeline.Event, index: dict[str, int]) -> list[Any]:
    """Return an event; ``index`` numbers the robots."""
    return [
        event.tick,
        event.kind.value,
        event.text,
        index.get(event.robot or "", -1),
        -1 if event.region is None else event.region,
    ]


def slack_data(slack: timeline.Slack) -> list[Any]:
    return [slack.tick, slack.of, slack.begin, slack.due, slack.verdict]


def _robot(replay: timeline.Replay, track: timeline.RobotTrack) -> dict[str, Any]:
    facing = [heading.name[0] for heading in track.headings if heading is not None]
    return {
        "name": track.name,
        "model": track.model,
        "shape": robot_pictogram(track.model),
        "layer": track.layer,
        "can": track.capabilities,
        "path": track.regions,
        "steps": steps_data(track.steps),
        "headings": "".join(facing) if len(facing) == len(track.regions) else None,
        "tasks": _changes(replay.objectives[track.name], lambda o: task_data(o, replay.map)),
        "progress": _changes(replay.progress[track.name], progress_data),
        "charge": None
        if track.name not in replay.charges
        else _changes(replay.charges[track.name], lambda percent: [percent]),
    }


def _view(
    replay: timeline.Replay, viewer: str, index: dict[str, int], sets: RegionSets
) -> dict[str, Any]:
    """Return a robot's sight and beliefs, each set of regions by its index in ``sets``."""
    sight = SightCache(replay.map)
    views = (sight.after(replay, viewer, tick) for tick in range(replay.last + 1))
    places = [None if view is None else sets.index(view) for view in views]
    seen = [
        [tick, place]
        for tick, place in enumerate(places)
        if place is not None and (tick == 0 or place != places[tick - 1])
    ]
    told = {other: c for (robot, other), c in replay.beliefs.items() if robot == viewer}
    return {
        "vision": replay.track(viewer).vision,
        "sight": seen,
        "beliefs": [
            [index[other], _changes(changes, lambda belief: belief_data(belief, sets.index))]
            for other, changes in told.items()
        ],
    }


def steps_data(steps: Sequence[timeline.LongStep]) -> list[list[Any]]:
    return [[s.first, s.last, s.toward, round(s.begin, 3), round(s.end, 3)] for s in steps]


def belief_data(
    belief: timeline.RobotBelief | None, placed: Callable[[Sequence[Region]], int | str]
) -> list[Any]:
    """Return a belief; ``placed``: how a set of regions is written."""
    return [0, -1] if belief is None else [int(belief.seen), placed(sorted(belief.regions))]


def met_data(needs: int) -> list[Any]:
    return [needs]


def status_data(status: timeline.ObstacleStatus) -> list[Any]:
    return [status.value]


def carriers_data(robots: Sequence[str], index: dict[str, int]) -> list[Any]:
    return [[index[robot] for robot in robots]]


def progress_data(done: timeline.RobotProgress) -> list[Any]:
    return [done.rounds, -1 if done.reached is None else done.reached]


def stack_data(frames: Sequence[timeline.StackRow], world: RegionMap) -> list[Any]:
    return [
        [
            [frame.about(world.word), frame.roles, frame.requester, [*frame.helpers]]
            for frame in frames
        ]
    ]


def task_data(objective: Objective | None, world: RegionMap) -> list[Any]:
    return [objective_words(objective, world.word), sorted(target_regions(objective))]


def _changes(changes: timeline.Changes[Any], value: Callable[[Any], list[Any]]) -> list[list[Any]]:
    return changed(zip(changes.ticks, changes.values, strict=True), value)


def changed(pairs: Iterable[tuple[int, Any]], value: Callable[[Any], list[Any]]) -> list[list[Any]]:
    """Return ticks and the values from then on, each as the page has it."""
    return [[max(0, tick), *value(held)] for tick, held in pairs]
