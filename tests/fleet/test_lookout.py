"""Readings of lidars and reports about regions, and when they count."""

import math

import pytest

from fleet.hall import (
    EAST,
    HOME,
    Robots,
    rays,
    scanned,
    seen,
    set_out,
    started,
    told,
)
from safenav.fleet.file import ScanUse
from safenav.fleet.transport import (
    Reported,
    Scanned,
)
from safenav.fleet.world import FleetWorld
from safenav.scenario.model import Scenario
from safenav.trace.records import Depart
from safenav.trace.vocabulary import ActResult, MovedBy
from safenav.world.poses import Pose

pytestmark = pytest.mark.usefixtures("short_limits")


def test_a_lidar_reports_a_door_before_the_arrival_is_reported() -> None:
    """A reading from the way there does not count; the one from the new place does."""
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    assert robots.goals == []
    world.observe(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    assert len(robots.goals) == 1  # it departs once the trace has recorded it
    robots.post(Scanned("digit", robots.stamp - 0.5, 0.0, math.pi / 2, rays(0.6, 1)))
    scanned(robots, "digit", 0.6)
    events = world.wait(5.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Arrived"]
    found = world.sense(scenario.robots[1], 10)
    assert found is not None and found.name == "door@10"
    assert world.sense(scenario.robots[1], 16) is None
    scanned(robots, "digit", 3.0)  # a person has opened it
    (gone,) = world.wait(5.0)
    assert told(gone) == ("Sensed", "digit", False) and world.sense(scenario.robots[1], 10) is None


@pytest.mark.parametrize("later", ["the other one finds nothing", "it does not look any more"])
def test_a_door_is_not_gone_while_another_lidar_hits_it(later: str) -> None:
    """From beside it a leaf may be too thin for the rays: the two robots would report it gone and
    there again with every scan."""
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    world.observe(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    scanned(robots, "digit", 0.6)
    world.wait(5.0)
    robots.x["quad"] = 3.5  # beside region 10, in the south
    world.placed(scenario.robots[1], Pose(17))
    robots.locate("quad")
    scanned(robots, "quad", 3.0)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[1], 10) is not None
    if later == "the other one finds nothing":
        scanned(robots, "digit", 3.0)
    else:
        robots.now += 5.0
        scanned(robots, "quad", 3.0)
    (gone,) = world.wait(5.0)
    assert told(gone)[2] is False and world.sense(scenario.robots[1], 10) is None


def test_a_ray_without_a_reading_changes_no_obstacle() -> None:
    world, robots, scenario = started(scan=ScanUse("door"))
    scanned(robots, "digit", 0.6)
    world.wait(0.05)
    robots.now += 5.0
    robots.locate("digit")
    scanned(robots, "digit", math.nan)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 9) is not None
    scanned(robots, "digit", 9.0)
    (gone,) = world.wait(0.05)
    assert told(gone)[2] is False


def test_a_lidar_hit_on_another_robot_is_not_an_obstacle() -> None:
    world, robots, scenario = started(scan=ScanUse("door"))
    scanned(robots, "digit", 0.6, ahead=3)  # to the south stands the quadcopter, in 15
    assert world.wait(0.05) == []
    assert world.sense(scenario.robots[0], 15) is None


def passed_by() -> tuple[FleetWorld, Robots, Scenario]:
    """The quadcopter has gone from region 15, south of digit, to 17 a moment ago."""
    world, robots, scenario = started(scan=ScanUse("door"))
    quad = scenario.robots[1]
    for number, at in enumerate((2.5, 3.5), start=1):
        robots.script = [("succeeded", at)]
        world.start(quad, Pose(15 + number), number)
        world.wait(0.02)
        scanned(robots, "quad", 9.0)
        assert [told(event)[0] for event in world.wait(0.05)] == ["Arrived"]
    return world, robots, scenario


def test_a_late_scan_does_not_make_an_obstacle_of_a_robot_that_has_left() -> None:
    """A scan is taken before it is heard. What it still hits later is an obstacle."""
    world, robots, scenario = passed_by()
    scanned(robots, "digit", 0.6, ahead=3)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 15) is None
    robots.now += 2.5
    robots.locate("quad")
    scanned(robots, "digit", 0.6, ahead=3)
    (found,) = world.wait(0.05)
    assert told(found) == ("Sensed", "digit", True)
    assert world.sense(scenario.robots[0], 15) is not None


@pytest.mark.parametrize("there", [False, True])
def test_a_robot_that_arrives_behind_another_scans_again_before_it_reports(there: bool) -> None:
    """Its first scan hits what was, or is, before it: an arrival is told when that is known."""
    world, robots, scenario = passed_by()
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 3)
    world.wait(0.02)
    scanned(robots, "digit", 0.6, ahead=3)  # to the south, where the quadcopter was
    assert world.wait(1.5) == []
    scanned(robots, "digit", 0.6, ahead=3)
    assert world.wait(0.05) == []
    robots.now += 0.6
    robots.locate("digit")
    scanned(robots, "digit", 0.6 if there else 9.0, ahead=3)
    assert [told(event)[0] for event in world.wait(0.05)] == ["Sensed"] * there + ["Arrived"]
    assert (world.sense(scenario.robots[0], 16) is not None) == there


def test_a_scan_from_the_way_is_not_read_after_the_arrival() -> None:
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    early = robots.stamp + 0.5
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]  # no scan in time
    robots.post(Scanned("digit", early, 0.0, math.pi / 2, rays(0.6, 0)))
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 10) is None


def test_a_scan_is_read_where_it_was_taken() -> None:
    """The robot turned after the scan: the wall that was on its left is not a door ahead of it."""
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    assert world.wait(0.0) == []
    stamp = robots.stamp + 0.5
    robots.stamp += 0.4
    robots.locate("digit", math.pi / 2)
    robots.locate("digit")
    robots.post(Scanned("digit", stamp, 0.0, math.pi / 2, rays(0.6, 0)))
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    assert world.sense(scenario.robots[0], 10) is None


def test_a_scan_waits_for_the_odometry_of_its_moment() -> None:
    world, robots, _ = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    robots.post(Scanned("digit", robots.stamp + 2.5, 0.0, math.pi / 2, rays(0.6, 0)))
    assert world.wait(0.02) == []
    robots.locate("digit")
    assert world.wait(0.0) == []
    robots.locate("digit")
    assert [told(event)[0] for event in world.wait(0.0)] == ["Sensed", "Arrived"]


def test_lidar_hits_on_a_lost_robot_are_not_an_obstacle() -> None:
    """Its odometry has ended in the region that it has left; its body is in the next one."""
    world, robots, scenario = started(scan=ScanUse("door"))
    robots.script = [(None, 2.4), (None, None)]
    world.start(scenario.robots[1], Pose(16), 1)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Lost"]
    robots.now += 5.0
    robots.script = [("succeeded", 2.5)]
    robots.locate("digit")
    scanned(robots, "digit", 9.0)
    world.start(scenario.robots[0], EAST, 2)
    world.wait(0.02)
    scanned(robots, "digit", 0.6, ahead=3)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    assert world.sense(scenario.robots[0], 16) is None


@pytest.mark.parametrize("comes", ["free", "door", "hit", "nothing"])
def test_a_robot_sets_out_when_it_has_seen_the_region_before_it(comes: str) -> None:
    """Another robot was what its last scan hit there, and has left since."""
    world, robots, scenario = started(scan=ScanUse("door"))
    robots.x["quad"], robots.y["quad"] = 2.5, 2.5
    world.placed(scenario.robots[1], Pose(9))
    robots.locate("quad")
    scanned(robots, "quad", 9.0)
    scanned(robots, "digit", 0.6)
    assert world.wait(0.02) == [] and world.sense(scenario.robots[0], 9) is None
    robots.script = [("succeeded", 3.5)]
    world.start(scenario.robots[1], Pose(10), 1)
    world.wait(0.02)
    scanned(robots, "quad", 9.0)
    assert [told(event)[0] for event in world.wait(0.02)] == ["Arrived"]
    world.start(scenario.robots[0], EAST, 2)
    assert world.wait(0.02) == [] and len(robots.goals) == 1  # it may be a door
    robots.script = [("succeeded", 2.5)]
    if comes == "free":
        scanned(robots, "digit", 9.0)
    elif comes == "door":
        robots.now += 2.5
        robots.locate("quad")
        scanned(robots, "digit", 0.6)
    elif comes == "hit":
        robots.now += 1.0
        scanned(robots, "digit", 0.6)
    found = [told(event) for event in world.wait(0.02)]
    if comes == "free":
        assert len(robots.goals) == 2
    elif comes == "door":
        assert [event[0] for event in found] == ["Sensed", "Blocked"]
    else:
        robots.now += 1.9
        robots.locate("digit")
        assert [told(event) for event in world.wait(0.5)] == [("Failed", HOME, False)]
    assert len(robots.goals) == 1 + (comes == "free")


def test_a_robot_beside_a_region_does_not_hide_a_door_there() -> None:
    """It stands 0.2 m off the middle of the next region: the hit is too far from it."""
    world, robots, scenario = started(side=2.0, scan=ScanUse("door"))
    robots.x["quad"], robots.y["quad"] = 3.4, 2.5
    world.placed(scenario.robots[1], Pose(10))
    robots.locate("quad")
    scanned(robots, "digit", 1.5)
    (found,) = world.wait(0.02)
    assert told(found) == ("Sensed", "digit", True)


def test_a_robot_sets_out_towards_one_that_stands_behind_the_region() -> None:
    """In small regions a lidar reaches beyond the one before it."""
    world, robots, scenario = started(scan=ScanUse("door"))
    robots.x["quad"], robots.y["quad"] = 3.2, 2.5
    world.placed(scenario.robots[1], Pose(10))
    robots.locate("quad")
    scanned(robots, "digit", 1.25)
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.02) == [] and len(robots.goals) == 1


def test_a_leaf_before_a_region_is_not_an_obstacle_in_it() -> None:
    """A robot in the region of an open door is near to its leaves."""
    world, robots, scenario = started(side=2.0, scan=ScanUse("door"))
    scanned(robots, "digit", 0.4)
    assert world.wait(0.02) == [] and world.sense(scenario.robots[0], 9) is None
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.02) == [] and robots.goals == []


def test_a_door_that_is_ajar_is_not_gone() -> None:
    """Its leaves are beside the middle of the passage, through which a ray goes."""
    world, robots, scenario = started(scan=ScanUse("door"))
    door = seen(world, robots, scenario)
    robots.now += 5.0
    robots.locate("digit")
    for ranges in ([1.02, 9.0, 1.02], [9.0, 9.0, 9.0]):
        robots.stamp += 1.0
        robots.post(Scanned("digit", robots.stamp, -0.2, 0.2, ranges))
        robots.locate("digit")
    (gone,) = world.wait(0.02)
    assert told(gone) == ("Sensed", "digit", False) and gone.obstacle is door
    assert world.wait(0.02) == []


@pytest.mark.parametrize("sensor", ["scan", "report"])
def test_a_late_sighting_of_a_resolved_obstacle_is_ignored(sensor: str) -> None:
    """It was on its way when the obstacle was resolved; one that comes 2 s later is new."""
    world, robots, scenario = started(scan=ScanUse("door"), report="obstacles")
    door = seen(world, robots, scenario)
    robots.results = [(ActResult.DONE, "")]
    world.act(scenario.robots[0], [door], 1)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Acted"]
    for later, expected in ((0.5, []), (2.5, ["Sensed"])):
        robots.now += later
        robots.locate("quad")
        robots.locate("digit")
        if sensor == "scan":
            scanned(robots, "digit", 0.6)
        else:
            robots.post(Reported("quad", "door@9"))
        assert [told(event)[0] for event in world.wait(0.02)] == expected


def test_a_late_report_does_not_hide_what_a_lidar_sees() -> None:
    world, robots, _ = started(scan=ScanUse("door"), report="obstacles")
    scanned(robots, "digit", 0.6)
    robots.post(Reported("quad", "-door@9"))
    assert [told(event) for event in world.wait(0.02)] == [("Sensed", "digit", True)]
    robots.now += 2.5
    robots.post(Reported("quad", "-door@9"))
    assert [told(event) for event in world.wait(0.02)] == [("Sensed", "quad", False)]
