"""The robots at a line of the trace: poses, objectives and actions."""

from __future__ import annotations

from safenav.audit.language import Pose
from safenav.audit.lines import Line, Made, Objective
from safenav.audit.run.progress import Progress
from safenav.audit.run.turn import taken
from safenav.audit.world import World

DECIMALS = 6
"""Digits of a charge in a live run."""


class Robots:
    """The robots, with the header and its map. Only ``Situation`` changes them."""

    def __init__(self, header: Line) -> None:
        self.header = header.scenario
        self.header_line = header.line
        world, robots = self.header.map, self.header.robots
        self.live, self.external = header.clock == "live", self.header.world == "external"
        self.grid = World(world.grid, world.rows, world.cols, live=self.live)
        self.region: dict[str, int] = {n: r.start for n, r in robots.items()}
        self.heading: dict[str, str | None] = {n: r.heading for n, r in robots.items()}
        self.toward: dict[str, int | None] = dict.fromkeys(robots)
        self.came: dict[str, int | None] = dict.fromkeys(robots)
        """The region from which each robot has entered its own; None if it was put there."""
        self.set_out: dict[str, int] = {}
        """The tick in which each robot in transit began its step."""
        self.own: dict[str, Objective] = {n: r.objective for n, r in robots.items()}
        self.base = dict(self.own)
        """The objectives of the header, which robots have while no input gives them another."""
        self.objectives = dict(self.own)
        """The objectives in force; ``own``: the robots' own ones. Turns keep the mapping, so it is
        replaced, never changed."""
        self.begun = self.header.begun or Made()
        """The run that this one continues; without fields if there is none."""
        self.done: dict[str, Line] = dict(self.begun.robots or {})
        """Progress of robots with their objectives, where this run continues another."""
        self.progress = {
            n: Progress.begun(r.objective, r.start, self.done.get(n)) for n, r in robots.items()
        }
        self.form: dict[tuple[str, Objective], str | None] = {}
        """The form in which each robot was synthesized for an objective last."""
        self.stop: dict[str, tuple[frozenset[int], ...]] = {}
        """The targets with which each robot last got a strategy for its charge."""
        self.signals: dict[str, Line] = {}
        """Each robot's last command inputs, where robots are driven by command inputs."""
        self.inputs = {each.name: False for each in self.header.inputs or ()}
        self.charge = {n: float(r.battery.start) for n, r in robots.items() if r.battery}
        """Charge of each robot with a battery; live, when its last step ended or began."""
        self.stands = dict.fromkeys(self.charge, 0.0)
        """Live: the time of that charge, in seconds, for robots whose last step has ended."""
        self.out: set[str] = set()
        """The robots that are out of service."""
        self.awaiting: set[str] = set()
        """Live: the robots that wait for a strategy."""
        self.under_way: dict[str, Line] = {}
        """Live: the step of each robot that has not ended."""
        self.ended: dict[str, Line] = {}
        """The end of each robot's last step: live until its next move shows it; in ticks the move,
        until its next turn, if the robot ended elsewhere than commanded."""
        self.lost: dict[str, frozenset[int]] = {}
        """Live: the possible regions of each robot whose step ended in an unknown region."""
        self.acting: dict[str, Line] = {}
        """Live: the action of each robot that has not ended."""
        self.rivals = {n: [o for o in robots if o != n and self.conflict(n, o)] for n in robots}
        """The robots with which each must never share a region."""
        self.exclusions = tuple(
            (frozenset(each.robots), frozenset(each.regions))
            for each in self.header.never_together or ()
        )
        """Robots of which at most one may be in some regions."""

    def has_heading(self, robot: str) -> bool:
        return self.header.robots[robot].mobility == "heading"

    def pose(self, robot: str) -> Pose:
        """Return the robot's pose; for a robot in transit, the pose where it will arrive."""
        here, toward, heading = self.region[robot], self.toward[robot], self.heading[robot]
        if toward is not None:
            here, heading = toward, self.grid.direction(here, toward)
        return here, heading if self.has_heading(robot) else None

    def taken_by(self, robot: str) -> set[int]:
        """Return the regions that a robot occupies: two while it is in transit."""
        toward = self.toward[robot]
        return {self.region[robot]} if toward is None else {self.region[robot], toward}

    def may_have(self, robot: str) -> set[int]:
        """Return the regions that a robot occupies or, if it is lost, may occupy."""
        taken, lost = self.taken_by(robot), self.lost.get(robot)
        return taken | lost if lost else taken

    def entered(self, move: Line) -> set[int]:
        """Return the regions that a robot occupies after a move but not before it."""
        return taken(move) - self.taken_by(move.robot)

    def charge_after(self, move: Line) -> float:
        """Return a robot's charge after a move; negative if it does not suffice."""
        charge, battery = self.charge[move.robot], self.header.robots[move.robot].battery
        if move.to != move.from_:
            return float(charge - battery.move)
        if move.toward is not None or self.had_turn(move.robot, move.tick):
            return charge
        if move.to in (self.header.chargers or ()):
            return float(min(battery.capacity, charge + battery.charge))
        return float(max(0, charge - battery.stay))

    def had_turn(self, robot: str, tick: int) -> bool:
        """Return whether a robot had its turn of this tick in the run that this one continues."""
        return tick <= 1 and robot in (self.begun.had or ())

    def charge_at(self, robot: str, t: float) -> float:
        """Live: return a robot's charge at a time; standing consumes or restores charge."""
        charge, battery = self.charge[robot], self.header.robots[robot].battery
        charges = self.region[robot] in (self.header.chargers or ())
        rate = battery.charge if charges else -battery.stay
        charge += rate * max(0.0, t - self.stands.get(robot, t))
        return float(round(min(battery.capacity, max(0, charge)), DECIMALS))

    def has_failed(self, robot: str) -> bool:
        """Return whether the step that a robot's next move ends (in ticks: the move that it just
        made) has failed or ends elsewhere than commanded."""
        return robot in self.ended and self.ended[robot].result != "arrived"

    def repeats_inputs(self, record: Line) -> bool:
        """Return whether a line on inputs only repeats their values, as after a user sets one."""
        return record.type == "inputs" and dict(record.values) == self.inputs

    def zones(self, one: str, other: str) -> list[frozenset[int]]:
        """Return the sets of regions that two robots must never occupy together."""
        return [regions for robots, regions in self.exclusions if {one, other} <= robots]

    def conflict(self, one: str, other: str) -> bool:
        """Return whether two robots must never share a region."""
        robots = self.header.robots
        listed = robots[one].conflicts, robots[other].conflicts
        if None in listed:
            return bool(robots[one].layer == robots[other].layer)
        return other in listed[0] or one in listed[1]

    def alternates(self, robot: str) -> bool:
        """Return whether the robot's strategy was synthesized for plain alternation."""
        return self.form.get((robot, self.objectives[robot])) == "alternation"

    def show(self, region: int) -> str:
        return self.grid.show(region)

    def is_away(self, robot: str) -> bool:
        """Return whether an input replaces a robot's objective, even by an equal one."""
        listed = self.header.robots[robot].when or ()
        return any(self.inputs.get(each.input) for each in listed)

    def is_to_return(self, robot: str) -> bool:
        """Return whether a robot resumes in this tick the objective that inputs had replaced."""
        listed = self.header.robots[robot].when or ()
        own, due = self.own[robot], self.due(robot)
        return not self.is_away(robot) and own != due and any(w.objective == own for w in listed)

    def due(self, robot: str) -> Objective:
        """Return the objective that the inputs assign to a robot now."""
        listed = self.header.robots[robot].when or ()
        return next((w.objective for w in listed if self.inputs.get(w.input)), self.base[robot])
