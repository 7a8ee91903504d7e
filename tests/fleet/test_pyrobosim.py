"""Robots in pyrobosim, an external simulator, whose hallways close during steps.

Its planner, executor and lidar drive and see. The positions that it reports are the judge.
"""

import contextlib
import json
import os
import random
import time
from collections.abc import Callable, Iterator
from math import hypot, pi
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from once import beside
from safenav.audit.check import check_trace
from safenav.errors import UsageError
from safenav.fleet.fleet_file import load_fleet
from safenav.fleet.place import Places
from safenav.fleet.pyrobosim.transport import PyrobosimTransport
from safenav.fleet.stations import FleetFile
from safenav.fleet.transport import GoalEnded, GoalPoint, Located, Message, Performed, Reported
from safenav.fleet.world import FleetWorld
from safenav.runtime.mission import Mission, default_synthesizer
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.writing import TraceWriter

SEEDS = 20 if "SAFENAV_FUZZ" in os.environ else 2
RADIUS = 0.25
FIRST, SECOND = 17, 34
"""The regions of the two hallways."""

SCENARIO = """\
safenav: 1
name: hall
map:
  resolution: 2.0
  grid: |
    #############
    #.......#...#
    #...#.......#
    #############
robots:
  opener: {{model: fetch, start: [2, {start}], objective: {{visit: [[1, {east}]]}}}}
  cart: {{model: jackal, start: [1, 1], objective: {{visit: [[1, 11]]}}}}
until: {{rounds: 1}}
clock: live
"""
WORLD = beside(__file__, "scenarios/pyrobosim.yaml")
FLEET = """\
safenav-fleet: 1
transport: pyrobosim
pyrobosim: {{world: lab.yaml, hallway: sliding_door, pace: 20, closing: {closing}}}
robots:
  opener: {{report: hallways, act: {{press: open}}}}
  cart: {{scan: {{topic: lidar, obstacle: sliding_door}}}}
"""


def lab(folder: Path, seed: int = 0, closing: str | None = None) -> tuple[Scenario, FleetFile]:
    """A mission through two hallways, whose closing times and ways the seed draws."""
    draw = random.Random(seed)
    start = draw.randint(1, 3)
    times = f"{{first: {draw.uniform(1, 12):.1f}, second: {draw.uniform(1, 30):.1f}}}"
    scenario, fleet = folder / "hall.yaml", folder / "fleet.yaml"
    scenario.write_text(SCENARIO.format(start=start, east=draw.randint(9, 10)))
    (folder / "lab.yaml").write_text(WORLD.replace("OPENER", str(2.0 * start + 1)))
    fleet.write_text(FLEET.format(closing=closing or times))
    plan = load_scenario(scenario)
    return plan, load_fleet(fleet, plan)


class Overheard:
    """A transport whose messages are kept, in their order."""

    def __init__(self, plan: Scenario, fleet: FleetFile) -> None:
        assert fleet.pyrobosim is not None and plan.map.frame is not None
        self.places = Places(plan.map, plan.map.frame)
        self.inner = PyrobosimTransport(self.places, fleet.stations, fleet.pyrobosim)
        self.said: list[Message] = []
        for name in ("missing", "navigate", "cancel", "perform", "close"):
            setattr(self, name, getattr(self.inner, name))

    def open(self, post: Callable[[Message], None]) -> None:
        def keep(message: Message) -> None:
            self.said.append(message)
            post(message)

        self.inner.open(keep)


def nearest(said: list[Message]) -> float:
    """The least distance of the two robots' centres, in metres."""
    at: dict[str, Located] = {}
    least = 99.0
    for message in said:
        if isinstance(message, Located):
            at[message.robot] = message
            if len(at) == 2:
                one, two = at.values()
                least = min(least, hypot(one.x - two.x, one.y - two.y))
    return least


def entered_closed(said: list[Message], places: Places) -> int:
    """How often a robot was in the middle of a hallway that a robot had seen closed."""
    closed, found = set(), 0
    for message in said:
        match message:
            case Reported():
                region = int(message.text.rpartition("@")[2])
                (closed.discard if message.text.startswith("-") else closed.add)(region)
            case Located():
                here = places.region(message.x, message.y)
                found += here in closed and places.distance(here, message.x, message.y) < 0.5
    return found


def resolved(trace: str) -> set[str]:
    """The obstacles that a trace says were resolved."""
    lines = [json.loads(line) for line in trace.splitlines()]
    found = [line["obstacle"] for line in lines if line["type"] == "resolved"]
    return set(found)


@pytest.fixture(scope="module", autouse=True)
def _installed() -> None:
    pytest.importorskip("shapely", reason="pip install 'pyrobosim>=5.0.1,<6' (extra 'pyrobosim')")
    pytest.importorskip("pyrobosim", reason="pip install 'pyrobosim>=5.0.1,<6'")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(SEEDS))
def test_hallways_that_close_on_the_way_are_opened(seed: int, tmp_path: Path) -> None:
    plan, fleet = lab(tmp_path, seed)
    transport: Any = Overheard(plan, fleet)
    world = FleetWorld(plan, fleet.stations, transport)
    trace = tmp_path / "trace.jsonl"
    try:
        world.open(20.0)
        with TraceWriter(trace) as writer:
            mission = Mission(plan, default_synthesizer(plan), world=world, listeners=[writer])
            outcome = mission.run()
    finally:
        world.close()
    text = trace.read_text()
    assert outcome.outcome.value == "completed", text[-1500:]
    assert check_trace(trace).findings == ()
    done = [m for m in transport.said if isinstance(m, Performed) and m.result.value == "done"]
    assert [m.robot for m in done] == ["opener"] * len(done)
    assert resolved(text) == {f"sliding_door@{region}" for region in (FIRST, SECOND)}
    assert nearest(transport.said) > 2 * RADIUS
    assert entered_closed(transport.said, transport.places) == 0


def test_a_path_that_leaves_the_two_regions_is_not_driven(tmp_path: Path) -> None:
    """Its planner may go round; the team's guarantees are of the regions that were reserved."""
    plan, fleet = lab(tmp_path)
    with started(plan, fleet) as transport:
        assert going(transport, "opener", 1, (7.0, 3.0)).end.value == "succeeded"
        far = going(transport, "opener", 2, (3.0, 5.0))
        assert far.end.value == "aborted" and "leaves the two regions" in far.reason


def test_a_closed_hallway_is_opened_by_its_action_only(tmp_path: Path) -> None:
    plan, fleet = lab(tmp_path, closing="{first: 0.1}")
    with started(plan, fleet) as transport:
        for number, x in enumerate((5.0, 7.0), 1):
            assert going(transport, "cart", number, (x, 5.0)).end.value == "succeeded"
        blocked = going(transport, "cart", 3, (9.0, 5.0))
        assert blocked.end.value == "aborted" and "no path" in blocked.reason
        transport.perform("cart", "open", f"sliding_door@{FIRST}", 4)
        assert heard(transport, Performed, 4).result.value == "done"
        transport.perform("cart", "open", f"sliding_door@{FIRST}", 5)
        assert heard(transport, Performed, 5).result.value == "nothing"
        transport.perform("cart", "open", "sliding_door@16", 6)
        assert heard(transport, Performed, 6).result.value == "nothing"
        assert going(transport, "cart", 7, (9.0, 5.0)).end.value == "succeeded"


def test_a_cancelled_robot_stops_before_its_goal(tmp_path: Path) -> None:
    plan, fleet = lab(tmp_path)
    fleet = replace(fleet, pyrobosim=replace(fleet.pyrobosim, pace=1.0))
    with started(plan, fleet) as transport:
        x = at(transport, "opener").x
        transport.navigate("opener", GoalPoint(1, x + 2.0, 3.0, None))
        transport.cancel("opener")
        assert heard(transport, GoalEnded, 1).end.value == "canceled"
        assert at(transport, "opener").x < x + 1.5
        transport.navigate("opener", GoalPoint(2, x, 3.0, pi / 2))
        assert heard(transport, GoalEnded, 2).end.value == "succeeded"
        turned = pytest.approx(pi / 2, abs=0.01)
        waited(lambda: at(transport, "opener").yaw == turned or None)


@contextlib.contextmanager
def started(plan: Scenario, fleet: FleetFile) -> Iterator[Any]:
    transport = Overheard(plan, fleet)
    transport.open(print)
    try:
        assert at(transport, "cart").x == 3.0
        yield transport
    finally:
        child = transport.inner._child
        transport.inner.close()
        transport.inner.close()
        assert child is not None and child.returncode == 0


def at(transport: Any, robot: str) -> Located:
    """Where a robot says it is."""
    return waited(lambda: newest(transport, Located, lambda m: m.robot == robot))


def heard(transport: Any, kind: Any, number: int) -> Any:
    return waited(lambda: newest(transport, kind, lambda m: m.number == number))


def going(transport: Any, robot: str, number: int, to: tuple[float, float]) -> Any:
    transport.navigate(robot, GoalPoint(number, *to, None))
    return heard(transport, GoalEnded, number)


def newest(transport: Any, kind: Any, wanted: Callable[[Any], bool]) -> Any:
    found = (m for m in reversed(list(transport.said)) if isinstance(m, kind) and wanted(m))
    return next(found, None)


def waited(find: Callable[[], Any]) -> Any:
    for _ in range(30_000):
        found = find()
        if found is not None:
            return found
        time.sleep(0.01)
    raise AssertionError("nothing was said")


WRONG = {
    "opener": ("robots:\n  - name: opener", "robots:\n  - name: other", "no robot 'opener'"),
    "hallway": ("name: second", "name: third", "no hallway 'second'"),
    "nonsense": ("rooms:", "rooms: 7\nrums:", "pyrobosim cannot load it"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_world_that_does_not_fit_is_refused(case: str, tmp_path: Path) -> None:
    old, new, told = WRONG[case]
    plan, fleet = lab(tmp_path)
    world = tmp_path / "lab.yaml"
    world.write_text(world.read_text().replace(old, new))
    transport: Any = Overheard(plan, fleet)
    with pytest.raises(UsageError, match=told):
        transport.open(print)
    transport.close()


def test_an_action_that_pyrobosim_lacks_is_refused(tmp_path: Path) -> None:
    plan, _ = lab(tmp_path)
    path = tmp_path / "fleet.yaml"
    path.write_text(path.read_text().replace("press: open", "press: kick"))
    with pytest.raises(UsageError, match="pyrobosim has no action 'kick'"):
        Overheard(plan, load_fleet(path, plan))
