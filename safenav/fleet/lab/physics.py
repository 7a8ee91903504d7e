"""A lab in MuJoCo for rehearsals and tests: simulated robots, walls and obstacles.

Robots track references by limited accelerations; for a goal, the reference leads straight there. A
robot on the ground is a capsule, a flyer a sphere at its altitude. An obstacle is a box for the
robots that must not enter its region. It disappears when its last need is fulfilled, and appears
and disappears at the times of the scenario. One that blocks no robot, such as an order or an empty
battery, has no body. Uncertain regions have none either; robots notice them from adjacent regions.
Units: metres, radians, seconds of simulated time.
"""

from collections.abc import Iterable, Sequence
from math import copysign, cos, hypot, inf, pi, sin, sqrt, tau
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct, field

from safenav.errors import UsageError
from safenav.fleet import transport
from safenav.fleet.robots import FleetProgress
from safenav.fleet.setpoints import TABLE, Setpoints
from safenav.fleet.transport import GoalEnd, GoalPoint, Places, turned
from safenav.motion.columns import body_rows
from safenav.motion.file import Curve
from safenav.motion.geometry import PEAK, quintic
from safenav.pace.robot import glide
from safenav.runtime.run.checkpoint import Resumption
from safenav.scenario.model import Need, Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region

BITS = 31
"""Number of contact bits in MuJoCo. Robots of a layer that the same obstacles block share one."""
BELOW = -10.0
"""Height in metres of absent obstacles: below the floor."""
HEIGHT, TALL = 1.8, 3.0
"""Heights in metres: of a robot on the ground, unless it is wider; of walls and obstacles."""
STEP = 0.01
"""Seconds of a step of the simulation."""
FORCE, TORQUE = 2.5, 20.0
"""Maximum accelerations of a robot on the ground, m/s^2 and rad/s^2."""
STIFF, BRAKING = 10.0, 1.5
"""Gain (1/s) with which a robot tracks its reference. For a distant reference, the square of the
approach speed divided by distance and acceleration; 2 would leave no reserve to brake."""
NEAR, SLOW, ALIGNED = 0.03, 0.05, 0.05
"""Tolerances in metres, metres per second and radians of a robot at its goal."""
STUCK = 3.0
"""Seconds from the end of its reference until an unreached goal is aborted."""
RAYS, FAR = 72, 8.0
"""Number of a lidar's rays and their range in metres."""
ACTING = 2.0
"""Seconds of an action."""


class LabObstacle(Struct, eq=False):
    """An obstacle. ``key``: its box's name; ``geom``: the box in the model, if there is one."""

    obstacle: Obstacle
    key: str
    geom: Any = None

    @property
    def solid(self) -> bool:
        """Whether the obstacle has a body."""
        return not self.obstacle.type.has_truth and self.obstacle.type.blocks != frozenset()


class Dimensions(Struct, frozen=True):
    """A robot's body: metres, metres per second, kg; ``height``: its altitude, 0 on the ground;
    ``pull``: its maximum acceleration in m/s^2."""

    name: str
    layer: str
    bit: int
    radius: float
    speed: float
    height: float
    mass: float
    pull: float


def body_of(robot: Robot, bit: int) -> Dimensions:
    """Return the dimensions of a robot. ``bit``: the contact bit of its body."""
    model = robot.model
    flies = model.figures is not None and model.figures.kind == "flyer"
    numbers = model.figures.values if model.figures is not None else {}
    return Dimensions(
        robot.name,
        model.layer,
        bit,
        numbers.get("size", model.size or 0.5) / 2,
        numbers.get("speed", model.speed or 0.5),
        numbers.get("altitude", 2.2) if flies else 0.0,
        0.5 if flies else 45.0,
        numbers.get("tilt", 3.4) if flies else FORCE,
    )


class Handling(Struct):
    """The action with this ``number``, which a robot performs on ``obstacle`` (None: there is none)
    at least ``until`` this time, in seconds."""

    action: str
    number: int
    obstacle: LabObstacle | None
    until: float


class SimulatedBody(Struct):
    """A robot. ``reference``: the reference that it tracks; ``goal``, ``acts``: its present goal
    and action, if any; ``ended``: unreported messages about the ends of goals and actions."""

    kind: Dimensions
    dofs: tuple[int, ...]
    reference: Setpoints
    goal: GoalPoint | None = None
    acts: Handling | None = None
    ended: list[transport.Message] = field(default_factory=list)


class Physics:
    """A world in MuJoCo in which robots start in the centres of their regions. ``begun``: the run
    that the world continues, from that run's time on."""

    def __init__(
        self,
        scenario: Scenario,
        places: Places,
        obstacles: Iterable[Obstacle],
        begun: Resumption | None = None,
    ) -> None:
        self._places, self._robots = places, scenario.robots
        self._progress = FleetProgress(scenario, begun)
        known = [LabObstacle(one, f"{one.name}~{number}") for number, one in enumerate(obstacles)]
        bits = contact_bits(self._robots, known)
        kinds = [*map(body_of, self._robots, bits)]
        self._model: Any = mujoco.MjModel.from_xml_string(_model_text(places, known, kinds))
        self._data: Any = mujoco.MjData(self._model)
        self._data.time = begun.kept.state.time if begun else 0.0
        # Views that stay valid: a read takes a tenth of the time of a lookup.
        self._coordinate, self._velocity = self._data.qpos.item, self._data.qvel.item
        self._force = self._data.qfrc_applied
        self._bodies: dict[str, SimulatedBody] = {}
        for robot, kind in zip(self._robots, kinds, strict=True):
            yaw = places.yaw(robot.start)
            at = (*places.centre(robot.start.region), places.frame.yaw if yaw is None else yaw)
            self._bodies[robot.name] = self._placed(kind, at)
        self._listed = frozenset(one.obstacle.name for one in known)
        self._later = [one for one in known if one.obstacle.appears is not None]
        self.standing = {o.obstacle.name: o for o in known if o.obstacle.appears is None}
        """The obstacles present now, by name."""
        for one in known:
            one.geom = self._model.geom(one.key) if one.solid else None
            self._show(one)
        mujoco.mj_forward(self._model, self._data)

    def _placed(self, kind: Dimensions, at: tuple[float, float, float]) -> SimulatedBody:
        """Place the body of a robot at x, y and yaw, at rest."""
        joints = [self._model.joint(f"{kind.name}.{axis}") for axis in "xya"]
        dofs = tuple(int(joint.dofadr[0]) for joint in joints)
        for dof, value in zip(dofs, at, strict=True):
            self._data.qpos[dof] = value
        return SimulatedBody(kind, dofs, straight(0.0, at, at))

    @property
    def now(self) -> float:
        return float(self._data.time)

    # Robots

    def _track(self, body: SimulatedBody) -> None:
        """Accelerate a robot like its reference, with corrections, within limits."""
        at, row = self._at(body), body.reference.at(self.now).tolist()
        speeds, kind = [*map(self._velocity, body.dofs)], body.kind
        for axis in (0, 1):
            off = row[axis] - at[axis]
            brakes = sqrt(BRAKING * kind.pull * abs(off))
            closing = min(STIFF / 2 * abs(off), brakes)
            speed = row[axis + 3] + copysign(closing, off)
            pull = row[axis + 6] + 2 * STIFF * (speed - speeds[axis])
            pull = max(-kind.pull, min(kind.pull, pull))
            self._force[body.dofs[axis]] = kind.mass * pull
        spin = 36.0 * turned(row[9] - at[2]) - 12.0 * speeds[2]
        inertia = kind.mass * kind.radius**2 / 2
        self._force[body.dofs[2]] = inertia * max(-TORQUE, min(TORQUE, spin))

    def _at(self, body: SimulatedBody) -> tuple[float, float, float]:
        """Return x, y and yaw of a robot's body in the world."""
        x, y, yaw = map(self._coordinate, body.dofs)
        return x, y, yaw

    def _here(self, body: SimulatedBody) -> Region | None:
        """Return a robot's region; None off the map."""
        return self._places.region(*self._at(body)[:2])

    def moves(self, robot: str) -> bool:
        body = self._bodies[robot]
        return body.goal is not None or self.now < body.reference.end

    # Commands

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        """Give a robot a new goal. A straight reference leads there, from rest to rest, at the
        robot's speed on average."""
        body = self._bodies[robot]
        start, kind = self._at(body), body.kind
        yaw = start[2] if goal.yaw is None else start[2] + turned(goal.yaw - start[2])
        far = hypot(goal.x - start[0], goal.y - start[1])
        lasts = glide(far, PEAK * kind.speed, kind.pull / 2)
        body.reference = straight(self.now, start, (goal.x, goal.y, yaw), lasts)
        body.goal = goal

    def follow(self, robot: str, reference: Setpoints) -> None:
        """From now on, let a robot track a reference, with times on the clock of the simulation.
        The simulation moves the robot during its actions."""
        body = self._bodies[robot]
        if body.acts is None:
            body.reference = reference

    def cancel(self, robot: str) -> None:
        """Cancel a robot's goal or reference. The robot brakes."""
        self._give_up(self._bodies[robot], GoalEnd.CANCELED)

    def perform(self, robot: str, action: str, number: int) -> None:
        """Let a robot act on an obstacle that needs this action."""
        body = self._bodies[robot]
        here = self._here(body)
        found = None if here is None else self._reached(here, action)
        body.acts = Handling(action, number, found, self.now + ACTING)

    def due(self, name: str) -> str:
        """Return the action that an obstacle needs next; empty if the obstacle is absent."""
        one = self.standing.get(name)
        return "" if one is None else self._need(one).action

    def bring(self, obstacle: Obstacle) -> None:
        """Add an unlisted obstacle without a body, created by the team itself: an operator's order
        or an empty battery."""
        if obstacle.type.blocks == frozenset() and obstacle.name not in self._listed:
            self.standing.setdefault(obstacle.name, LabObstacle(obstacle, obstacle.name))

    def told(self, robot: str) -> tuple[transport.Located, list[transport.Message]]:
        """Return a robot's odometry and the unreported ends of its goals and actions."""
        body = self._bodies[robot]
        ended, body.ended = body.ended, []
        return transport.Located(robot, self.now, *self._at(body)), ended

    def scan(self, name: str) -> tuple[float, list[float]]:
        """Return the stamp (seconds) and ranges (metres) of a lidar, counter-clockwise from the
        robot's front."""
        body = self._bodies[name]
        x, y, yaw = self._at(body)
        origin = np.array([x, y, body.kind.height or 0.5])
        own = self._model.body(name).id
        hit = np.zeros(1, dtype=np.int32)
        found = []
        for index in range(RAYS):
            angle = yaw + tau * index / RAYS
            ray = np.array([cos(angle), sin(angle), 0.0])
            far = mujoco.mj_ray(self._model, self._data, origin, ray, None, 1, own, hit)
            found.append(float(far) if 0 <= far <= FAR else inf)
        return self.now, found

    def noticed(self, name: str, *, bodies: bool = False) -> dict[Region, str | None]:
        """Return the adjacent regions, each with the obstacle that the robot sees there (None:
        none): an uncertain region or, with ``bodies``, any obstacle."""
        here = self._here(self._bodies[name])
        near = () if here is None else self._places.world.neighbours(here)
        found: dict[Region, str | None] = dict.fromkeys(near)
        for one in self.standing.values():
            seen = one.obstacle.type.has_truth or (one.solid and bodies)
            if seen and one.obstacle.region in found:
                found[one.obstacle.region] = one.obstacle.name
        return found

    def step(self, seconds: float) -> None:
        """Advance the simulation by a time, rounded to steps."""
        for _ in range(max(1, round(seconds / STEP))):
            self._step()

    # Steps

    def _step(self) -> None:
        self._change(self.now)
        self._force[:] = 0.0
        for body in self._bodies.values():
            self._track(body)
        mujoco.mj_step(self._model, self._data)
        for body in self._bodies.values():
            self._judge(body)

    def _judge(self, body: SimulatedBody) -> None:
        """End a reached or overdue goal, and an action whose time has passed."""
        act, goal = body.acts, body.goal
        if goal is not None:
            x, y, yaw = self._at(body)
            far = hypot(goal.x - x, goal.y - y)
            off = 0.0 if goal.yaw is None else abs(turned(goal.yaw - yaw))
            near = self.now >= body.reference.end and far < NEAR and off < ALIGNED
            if near and hypot(*map(self._velocity, body.dofs[:2])) < SLOW:
                self._end(body, GoalEnd.SUCCEEDED)
            elif self.now > body.reference.end + STUCK:
                self._give_up(body, GoalEnd.ABORTED)
        elif act is not None and self.now >= act.until:
            self._worked(body, act)

    def _end(self, body: SimulatedBody, end: GoalEnd) -> None:
        """End a robot's goal, if it has one."""
        if body.goal is not None:
            body.ended.append(transport.GoalEnded(body.kind.name, body.goal.number, end))
            body.goal = None

    def _give_up(self, body: SimulatedBody, end: GoalEnd) -> None:
        """End a robot's goal, and let the robot rest where it is."""
        self._end(body, end)
        at = self._at(body)
        body.reference = straight(self.now, at, at)

    # Obstacles

    def _show(self, one: LabObstacle) -> None:
        """Move an obstacle's box into its region, with the contact bits of the robots that must not
        enter this region now. Move the box below the floor if the obstacle is absent."""
        if one.geom is None:
            return
        stage = self._progress.need(one.obstacle)
        closed = [r.name for r in self._robots if one.obstacle.closed_to(r, stage)]
        one.geom.conaffinity = sum({self._bodies[name].kind.bit for name in closed})
        there = self.standing.get(one.obstacle.name) is one
        self._model.geom_pos[one.geom.id][2] = TALL / 2 if there else BELOW

    def _change(self, now: float) -> None:
        """Let obstacles appear and disappear at their times. One with a body appears in no region
        that a robot occupies or to which it is in transit."""
        for one in [*self.standing.values()]:
            if one.obstacle.goes is not None and one.obstacle.goes <= now:
                self._remove(one)
        for one in [o for o in self._later if (o.obstacle.appears or 0) <= now]:
            if not (one.solid and self._busy(one.obstacle.region)):
                self._later.remove(one)
                self.standing[one.obstacle.name] = one
                self._show(one)

    def _remove(self, one: LabObstacle) -> None:
        del self.standing[one.obstacle.name]
        self._progress.forget(one.obstacle)
        self._show(one)

    def _busy(self, region: Region) -> bool:
        """Return whether a robot overlaps a region or is in transit to it."""
        return any(
            self._places.outside(region, x, y) <= body.kind.radius
            for body in self._bodies.values()
            for x, y in (self._at(body)[:2], body.reference.rows[-1, :2].tolist())
        )

    def _reached(self, here: Region, action: str) -> LabObstacle | None:
        """Return the obstacle on which a robot acts: one whose next need this action can fulfil
        from the robot's region, else one in or beside its region with a need of this action; None
        if there is none."""
        world, beside = self._places.world, None
        near = {here, *world.neighbours(here)}
        for one in self.standing.values():
            if not any(need.action == action for need in one.obstacle.needs):
                continue
            need, number = self._need(one), self._progress.need(one.obstacle)
            due = need.action == action
            if due and here in one.obstacle.resolution_regions(world, number):
                return one
            if one.obstacle.region in near and not (due and isinstance(need.at, frozenset)):
                beside = one
        return beside

    def _need(self, one: LabObstacle) -> Need:
        """Return the next need of a present obstacle."""
        return one.obstacle.needs[self._progress.need(one.obstacle)]

    def _worked(self, body: SimulatedBody, act: Handling) -> None:
        """End a robot's work: it does its part of the obstacle's next need, alone or with the other
        robots that have finished their work."""
        one = act.obstacle
        if one is None or self.standing.get(one.obstacle.name) is not one:
            self._answer(ActResult.NOTHING, body.kind.name)
            return
        there = {
            name: region
            for name, other in self._bodies.items()
            if (own := other.acts) is not None
            and own.obstacle is one
            and own.action == self._need(one).action
            and self.now >= own.until
            and (region := self._here(other)) is not None
        }
        name = body.kind.name
        group = self._progress.group(one.obstacle, name, there)
        if not group:
            self._answer(ActResult.FAILED, name)
            return
        resolved = self._progress.meet(one.obstacle, name, there)
        passable = not one.obstacle.type.has_truth or one.obstacle.traversable
        self._answer(ActResult.DONE if passable else ActResult.UNTRAVERSABLE, *group)
        if resolved:
            self._remove(one)
        else:
            self._show(one)

    def _answer(self, result: ActResult, *team: str) -> None:
        """End the present actions of these robots with this result."""
        for name in team:
            body = self._bodies[name]
            assert body.acts is not None
            body.ended.append(transport.Performed(name, body.acts.number, result))
            body.acts = None


def contact_bits(robots: Sequence[Robot], obstacles: Iterable[LabObstacle]) -> list[int]:
    """Return the contact bit of each robot. Raises UsageError if there are too few bits."""
    solids = [one.obstacle for one in obstacles if one.solid]
    stages = [(one, need) for one in solids for need in range(len(one.needs))]
    stopped = [(r.model.layer, *(one.closed_to(r, need) for one, need in stages)) for r in robots]
    kinds = [*dict.fromkeys(stopped)]
    if len(kinds) > BITS:
        found = f"{len(kinds)} kinds of robots by layer and by the obstacles that stop them"
        raise UsageError(f"{found}: the simulation distinguishes at most {BITS}")
    return [1 << kinds.index(kind) for kind in stopped]


def straight(
    begin: float, start: Sequence[float], goal: Sequence[float], seconds: float = 0.0
) -> Setpoints:
    """Return the reference of a straight path between x, y and yaw: quintics from rest to rest."""
    count = int(seconds / TABLE) + 1
    lasts = max(count - 1, 1) * TABLE
    ends = zip(start, goal, strict=True)
    x, y, yaw = (quintic(lasts, here, 0.0, there, 0.0) for here, there in ends)
    times = TABLE * np.arange(count, dtype=np.float64)
    return Setpoints(begin, TABLE, body_rows(Curve(lasts, x, y, (0.0,), yaw), times))


def _model_text(
    places: Places, obstacles: Iterable[LabObstacle], bodies: Sequence[Dimensions]
) -> str:
    """Return the model of a lab in MuJoCo's format."""
    parts = [_box(places, r, f"wall.{r}", 0.5) for r in sorted(places.world.walls)]
    parts += [_box(places, o.obstacle.region, o.key, 0.3) for o in obstacles if o.solid]
    for body in bodies:
        parts.append(_robot(body, sum({o.bit for o in bodies if o.layer == body.layer})))
    return (
        f'<mujoco><option timestep="{STEP}" integrator="implicitfast" gravity="0 0 0"/>'
        f"<worldbody>{''.join(parts)}</worldbody></mujoco>"
    )


def _box(places: Places, region: Region, name: str, share: float) -> str:
    """Return a box in a region. ``share``: its half-widths as shares of the region's side."""
    x, y = places.centre(region)
    half = share * places.frame.resolution
    return (
        f'<geom name="{name}" type="box" pos="{x} {y} {TALL / 2}" contype="0" '
        f'conaffinity="{(1 << BITS) - 1}" '
        f'size="{half} {half} {TALL / 2}" euler="0 0 {places.frame.yaw * 180 / pi}"/>'
    )


def _robot(body: Dimensions, beside: int) -> str:
    """Return the text of a robot. ``beside``: the contact bits of all robots of its layer."""
    half = max(HEIGHT / 2 - body.radius, 0.01)
    shape, z = f'type="capsule" size="{body.radius} {half}"', half + body.radius
    if body.height:
        shape, z = f'type="sphere" size="{body.radius}"', body.height
    return (
        f'<body name="{body.name}" pos="0 0 {z}">'
        f'<joint name="{body.name}.x" type="slide" axis="1 0 0"/>'
        f'<joint name="{body.name}.y" type="slide" axis="0 1 0"/>'
        f'<joint name="{body.name}.a" type="hinge" axis="0 0 1"/>'
        f'<geom name="{body.name}" {shape} mass="{body.mass}" friction="0.05" priority="1" '
        f'contype="{body.bit}" conaffinity="{beside}"/></body>'
    )
