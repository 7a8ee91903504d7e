"""``python -m safenav.fleet.pyrobosim.host WORLD PACE``: a pyrobosim world for another process.

Commands arrive as JSON lines on standard input, and messages are written to standard output.
pyrobosim plans, moves the robots, simulates lidars, and opens and closes hallways by its own rules.
Its threads do not end by themselves: the process exits at the end of standard input.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from math import atan2, inf, tau
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from safenav.fleet.place import turned
from safenav.lines import line_output

RATE = 50.0
"""Odometry and reports per second; scans only while a robot stands."""
HERE = 0.005
"""Metres and radians within which a robot counts as already at its goal."""

Line = dict[str, Any]


class HostedRobot:
    """A robot and the thread that carries out its commands one after another."""

    def __init__(self, robot: Any, world: Any, pace: float, write: Callable[[Line], None]) -> None:
        self.robot, self._world, self._pace, self._write = robot, world, pace, write
        self._commands: SimpleQueue[Line] = SimpleQueue()
        self._open_lines: list[Line] = []  # the command under way first
        threading.Thread(target=self._work, daemon=True).start()

    def command(self, line: Line) -> None:
        """Stop the command under way, then execute this one."""
        for earlier in self._open_lines:
            earlier["stopped"] = True
        if line["do"] != "stop":
            self._open_lines.append(line)
            self._commands.put(line)

    def is_sent_to(self, place: tuple[float, float]) -> bool:
        """Return whether a point (metres) is in the regions of the robot's open commands."""
        from shapely import Point, Polygon

        lines = list(self._open_lines)
        return any(Polygon(c).covers(Point(place)) for line in lines for c in line["within"])

    def tick(self, sensor: str | None) -> None:
        """Send the robot's position, what it knows and, while it stands, its lidar scan."""
        if self.robot.path_executor is not None and any("stopped" in o for o in self._open_lines):
            self.robot.path_executor.cancel_execution = True
        name, at, now = self.robot.name, self.robot.get_pose(), time.monotonic()
        yaw = at.get_yaw()
        self._write({"at": name, "t": now, "x": at.x, "y": at.y, "yaw": yaw})
        self._report_closed()
        if self._open_lines:
            return
        lidar = self.robot.sensors.get(sensor)
        if lidar is not None:
            lidar.update()
            ranges = _rays(lidar, at, yaw)
            self._write({"scan": name, "t": now, "step": tau / 360, "ranges": ranges})

    def _report_closed(self) -> None:
        """Send the hallways that the robot knows to be closed."""
        closed = {hallway.name for hallway in self.robot.get_known_closed_hallways()}
        self._write({"closed": sorted(closed), "by": self.robot.name})

    def _work(self) -> None:
        while True:
            line = self._commands.get()
            try:
                answer = self._open(line) if line["do"] == "open" else self._go(line)
            except Exception as error:  # an error of the planner fails the goal
                answer = ("failed" if line["do"] == "open" else "aborted", str(error))
            self._report_closed()  # first, since a closed hallway may be the reason of the failure
            self._open_lines.remove(line)
            done = "acted" if line["do"] == "open" else "end"
            ended = {"number": line["number"], "result": answer[0], "reason": answer[1]}
            self._write({done: self.robot.name, **ended})

    def _go(self, line: Line) -> tuple[str, str]:
        from pyrobosim.utils.pose import Pose

        if "stopped" in line:
            return "canceled", ""
        at = self.robot.get_pose()
        yaw = line["yaw"]
        goal = Pose(x=line["x"], y=line["y"], yaw=at.get_yaw() if yaw is None else yaw)
        return self._drive(goal, line["within"], turns=yaw is not None)

    def _drive(self, goal: Any, within: Any, turns: bool) -> tuple[str, str]:
        """Drive by the robot's own planner, unless its path leaves the regions ``within``."""
        from pyrobosim.utils.path import Path as PlannedPath

        at = self.robot.get_pose()
        off = abs(turned(goal.get_yaw() - at.get_yaw())) if turns else 0.0
        if at.get_linear_distance(goal) < HERE:
            if off < HERE:
                return "succeeded", ""
            if self.robot.path_executor.max_angular_velocity is None:
                self.robot.set_pose(goal)  # it turns instantly
                return "succeeded", ""
            path = PlannedPath(poses=[at, goal])
        else:
            self.robot.reset_path_planner()  # its graph does not change when a hallway closes
            path = self.robot.plan_path(goal=goal)
            if path is None or path.num_poses == 0:
                return "aborted", "its planner found no path"
            if not _inside(path, within):
                return "aborted", "its planner's path leaves the two regions"
            if not turns:
                path.poses[-1].set_euler_angles(yaw=path.poses[-2].get_yaw())
        result = self.robot.navigate(path=path, realtime_factor=self._pace)
        ends = {"SUCCESS": "succeeded", "CANCELED": "canceled"}
        return ends.get(result.status.name, "aborted"), result.message or result.status.name

    def _open(self, line: Line) -> tuple[str, str]:
        """Drive to the nearer end of a hallway, open it, and come back."""
        hallway = self._world.get_hallway_by_name(line["hallway"])
        if hallway.is_open:
            return "nothing", "it is open"
        home = self.robot.get_pose()
        end = min(hallway.nav_poses, key=home.get_linear_distance)
        went, why = self._drive(end, line["within"], turns=True)
        if went == "succeeded":
            opened = self.robot.open_location()
            went = "done" if opened.is_success() and hallway.is_open else "failed"
            why = opened.message
        back, problem = self._drive(home, line["within"], turns=True)
        if back != "succeeded":
            return "failed", f"it did not return to its region: {problem}"
        return ("done", why or "") if went == "done" else ("failed", why or "")


def _inside(path: Any, within: Any) -> bool:
    """Return whether a path stays in the union of some polygons."""
    from shapely import LineString, Polygon, unary_union

    line = LineString([(pose.x, pose.y) for pose in path.poses])
    regions = unary_union([Polygon(corners) for corners in within])
    return bool(regions.buffer(HERE).covers(line))


def _rays(lidar: Any, at: Any, yaw: float) -> list[float | None]:
    """Return the range in metres for each degree, counter-clockwise from the robot's front; None
    without a hit or a beam. pyrobosim's list of lengths omits beams, so the ends of its lines are
    used."""
    found: list[float | None] = [None] * 360
    for line in lidar.lidar_lines:
        if line.length >= lidar.max_range_m - HERE:
            continue
        x, y = max(line.coords, key=lambda end: (end[0] - at.x) ** 2 + (end[1] - at.y) ** 2)
        beam = round(turned(atan2(y - at.y, x - at.x) - yaw) * 360 / tau) % 360
        found[beam] = min(line.length, found[beam] or inf)
    return found


def main(world_file: Path, pace: float) -> None:
    write = line_output()
    try:
        from pyrobosim.core.yaml_utils import WorldYamlLoader

        world = WorldYamlLoader().from_file(world_file)
    except Exception as error:  # its loader may raise anything
        write({"error": f"{type(error).__name__}: {error}"})
        return
    robots = {robot.name: HostedRobot(robot, world, pace, write) for robot in world.robots}
    halls = {hall.name: hall.closed_polygon.centroid.coords[0] for hall in world.hallways}
    write({"ready": sorted(robots), "hallways": halls})
    commands: SimpleQueue[Line] = SimpleQueue()
    threading.Thread(target=_listen, args=(commands,), daemon=True).start()
    sensors: dict[str, str] = {}
    closing: dict[str, float] = {}
    begun = time.monotonic()
    while True:
        while not commands.empty():
            line = commands.get()
            if line["do"] == "start":
                sensors, closing, begun = line["sensors"], line["closing"], time.monotonic()
            else:
                robots[line["robot"]].command(line)
        for name, robot in robots.items():
            robot.tick(sensors.get(name))
        for name, at in list(closing.items()):
            due = (time.monotonic() - begun) * pace >= at
            if not due or any(robot.is_sent_to(halls[name]) for robot in robots.values()):
                continue
            # pyrobosim refuses while a robot is in the hallway
            if world.close_location(name).is_success():
                del closing[name]
        time.sleep(1 / RATE)


def _listen(commands: SimpleQueue[Line]) -> None:
    for text in sys.stdin:
        commands.put(json.loads(text))
    os._exit(0)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), float(sys.argv[2]))
    finally:
        os._exit(1)
