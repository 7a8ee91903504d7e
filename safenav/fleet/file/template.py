"""A fleet file to start from."""

from __future__ import annotations

from math import floor

from safenav.fleet.file.stations import FollowUse, Station, on_regions, side_of
from safenav.scenario.lint import arrival_room
from safenav.scenario.model import Scenario
from safenav.trace.words import listed


def template_text(scenario: Scenario) -> str:
    """Return a commented fleet file for the robots of a scenario; it loads unchanged."""
    follow = on_regions(FollowUse().tolerance, side_of(scenario.map))
    lines = [
        "# How safenav reaches each robot, what it senses and how it acts (docs/drive.md).",
        "safenav-fleet: 1",
        "transport: ros2          # ros2 or simulation",
        "network:",
        "  domain: 0              # ROS_DOMAIN_ID",
        "  interface: lo          # the network of your robots, for example wlan0",
        "  peers: [127.0.0.1]     # their addresses; [] for multicast",
        "defaults:",
        f"  tolerance: {_tolerance(scenario):<11g} # metres from the centre of a region: arrived",
        "  timeout: 3             # times the expected time, then the goal is cancelled",
        "  retries: 2             # number of times that a failed goal is sent again",
        f"  # follow: {{topic: reference, tolerance: {follow:g}}}  # references instead of goals",
        "robots:",
    ]
    if scenario.inputs:
        topics = ", ".join(f"{each.name}: /{each.name}" for each in scenario.inputs)
        lines.insert(-1, f"inputs: {{{topics}}}  # topics, std_msgs/Bool")
    stop = {o.type.name for o in scenario.obstacles if o.type.blocks != frozenset()}
    solid = sorted(stop - {o.type.name for o in scenario.obstacles if o.type.has_truth})
    if len(solid) > 1:
        lines.insert(-1, f"# no 'scan': a lidar cannot distinguish {listed(solid)}; 'report' does")
    for robot in scenario.robots:
        acts = ", ".join(f"{action}: {action}" for action in sorted(robot.capabilities))
        speed = 0.5 if robot.model.speed is None else robot.model.speed
        lines += [
            f"  {robot.name}:",
            f"    namespace: /{robot.name}",
            f"    speed: {speed:g}",
            "    report: obstacles    # std_msgs/String: 'door@47', or '-door@47' when it is gone",
        ]
        if len(solid) == 1:
            lines.append(f"    scan: {{topic: scan, obstacle: {solid[0]}}}")
        if acts:
            lines.append(f"    act: {{{acts}}}   # std_srvs/Trigger")
    return "\n".join(lines) + "\n"


def _tolerance(scenario: Scenario) -> float:
    """Return the default tolerance, or less if a robot that arrives so far from the centre of a
    region reaches into the next one."""
    rooms = (floor(100 * room) / 100 for _, _, _, room in arrival_room(scenario))
    default = on_regions(Station("/").tolerance, side_of(scenario.map))
    return min((default, *filter(None, rooms)))
