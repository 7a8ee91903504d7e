"""The state of a team, and the events that change it: frozen, hashable records with indices."""

from enum import StrEnum
from typing import NamedTuple

from msgspec import Struct

from safenav.scenario import model
from safenav.scenario.objective import Objective, Pursuit
from safenav.world.poses import Pose


class Stage(NamedTuple):
    """The progress of an obstacle: its next need, the robots that have done their part of it, and
    the robots of the previous need if only these may fulfil it (None: any robots)."""

    need: int = 0
    done: frozenset[int] = frozenset()
    group: frozenset[int] | None = None


class Count(NamedTuple):
    """Progress with an objective. ``memory`` of its pursuit; ``met``: the goals (in turn) or rounds
    met since the last resolution; ``held``: whether the robot stood at its last target at the last
    count; ``last``: the index of the last counted target."""

    memory: int = 0
    met: int = 0
    held: bool = False
    last: int = -1

    def turn(self, pursuit: Pursuit) -> int:
        """Return the index of the target that a strategy meets first if targets are met in turn or
        the objective settles. Otherwise, return one more than that of the last counted target."""
        return self.memory if pursuit.in_turn else 0 if pursuit.settles else self.last + 1


class Is(StrEnum):
    """The state of an obstacle. ``AWAY``: it has not appeared yet; ``HIDDEN``: the team does not
    know it; ``SEEN``: a sensor shows it, without a request; ``OPEN``: it was encountered or
    ordered, with a request; ``SEALED``: it is permanent (in O), since it is untraversable or can
    never be resolved; ``OVER``: it is resolved or gone."""

    AWAY = "away"
    HIDDEN = "hidden"
    SEEN = "seen"
    OPEN = "open"
    SEALED = "sealed"
    OVER = "over"


class ObstacleNow(Struct, frozen=True):
    """An obstacle now. ``asked``: the robots that have encountered it, each with the region where
    it waits, the latest last; ``given_up``: whether it is sealed because no robot can resolve it,
    not because it is untraversable; ``aside``: whether no joint plan serves it; ``due``: the tick
    by whose end it must be resolved."""

    state: Is = Is.HIDDEN
    stage: Stage = Stage()
    asked: tuple[tuple[int, int], ...] = ()
    given_up: bool = False
    aside: bool = False
    due: int | None = None

    @property
    def known(self) -> bool:
        """Whether the team knows the obstacle as unresolved, so that robots may act on it."""
        return self.state in (Is.OPEN, Is.SEEN) or self.given_up

    @property
    def stands(self) -> bool:
        """Whether the obstacle was encountered or ordered and is still present."""
        return self.state in (Is.OPEN, Is.SEALED)


Values = tuple[tuple[str, int], ...]
"""Values of the memory of formulas, and of inputs."""


Known = int | frozenset[int]
Base = tuple[Objective, int | None, Count, Values]
"""An objective, the deadline of its rounds in ticks, its progress and values."""


class RobotNow(Struct, frozen=True):
    """A robot now. ``to``: the pose to which its step leads (it reserves both regions); ``due``:
    the tick in which this step ends (lockstep). ``objective``: the one in force, with the progress
    ``task``; ``own``: the progress with its own objective. ``node``: its strategy's node at its
    next pose. ``at``: the index of its waypoint in the joint plan; ``by``: the origin of the step
    under way; ``command``: the number of its last command (live). ``acting``: the robot in whose
    action it takes part; ``works``: the obstacles of its own action (live). ``active``: whether it
    is in service; ``failed``: the regions of the steps that failed since it last arrived.
    ``fresh``: whether it has counted no goal of a new objective yet. ``values``: its formulas'
    memory and inputs at its next decision; ``came``: its pose and these values before its last
    turn. ``known``: for each robot that it tracks, a region, or the cells that may hold it.
    ``mode``: the input that set its own objective; ``base``: its objective before that. ``charge``:
    its battery's charge; ``flat``: whether it has run out of charge and waits for another battery;
    ``cause``: the reason why it is out of service. ``behind``: the region from which it entered its
    present one (None: it was put there). ``broken``: the assumptions of its last strategy that did
    not hold."""

    pose: int
    objective: Objective
    own: Count = Count()
    task: Count = Count()
    to: int | None = None
    due: int | None = None
    node: int | None = None
    at: int = 0
    by: str | None = None
    command: int = 0
    acting: int | None = None
    works: tuple[int, ...] = ()
    fresh: bool = True
    active: bool = True
    failed: tuple[int, ...] = ()
    values: Values = ()
    came: tuple[int, Values] | None = None
    known: tuple[tuple[int, Known], ...] = ()
    mode: str | None = None
    base: Base | None = None
    charge: float = 0
    flat: bool = False
    cause: str = ""
    behind: int | None = None
    broken: tuple[str, ...] = ()

    @property
    def next(self) -> int:
        """The pose of the robot's next decision: its destination, if it is in transit."""
        return self.pose if self.to is None else self.to

    @property
    def idle(self) -> bool:
        return self.to is None and self.acting is None


class Waypoint(NamedTuple):
    """A stop of a plan: a pose, and the conditions of the step to it. ``after``: pairs (robot,
    waypoint): that robot has arrived there; ``needs``: pairs (obstacle, n): n of its needs are
    fulfilled; ``progress``: the robot's count (memory and met) if exactly the obstacles ``over``
    are over (goals met by staying count immediately in the plan); ``charge``: the robot's charge
    then; on a charger the robot waits for it, and until ``tick``."""

    pose: int
    after: tuple[tuple[int, int], ...] = ()
    needs: frozenset[tuple[int, int]] = frozenset()
    progress: tuple[int, int] = (0, 0)
    over: frozenset[int] = frozenset()
    charge: float = 0
    tick: float = 0


class Plan(Struct, frozen=True):
    """A joint plan in execution: the waypoints of each robot (the present one first; else empty).
    ``foreseen``: the obstacles that the plan considers; ``charges``: each robot's charge at its
    end, if charges suffice (negative: unknown); ``part``: whether it completes only a part of the
    mission."""

    ways: tuple[tuple[Waypoint, ...], ...]
    foreseen: frozenset[int]
    charges: tuple[float, ...] = ()
    part: bool = False


class State(Struct, frozen=True):
    """A team's state. ``requests``: the open obstacles, the oldest first: the paper's stack.
    ``over``: obstacles resolved in this run, in order. ``time``: tick or seconds. ``attempts``:
    failed actions, as pairs of a robot and an obstacle. ``inputs``: the inputs that are on."""

    robots: tuple[RobotNow, ...]
    obstacles: tuple[ObstacleNow, ...]
    requests: tuple[int, ...] = ()
    over: tuple[int, ...] = ()
    plan: Plan | None = None
    time: float = 0
    attempts: tuple[tuple[int, int], ...] = ()
    inputs: frozenset[str] = frozenset()

    @property
    def gates(self) -> tuple[int, ...]:
        """The open obstacles in the order of service: those with deadlines, by their ticks; then
        those of robots, the newest first, as in the paper's stack; then orders, the oldest first,
        so that new orders delay no earlier one."""
        asked = [k for k in self.requests[::-1] if self.obstacles[k].asked]
        ordered = [k for k in self.requests if not self.obstacles[k].asked]
        dues = {k: self.obstacles[k].due for k in (*asked, *ordered)}
        return tuple(sorted(dues, key=lambda k: (dues[k] is None, dues[k] or 0)))

    @property
    def sealed(self) -> frozenset[int]:
        return frozenset(k for k, each in enumerate(self.obstacles) if each.state is Is.SEALED)


class Event(Struct, frozen=True):
    """A fact, or a decision of the team, that becomes part of the state."""


class Change(Event, frozen=True):
    """An event outside the turns of robots, after which the team decides again."""


class Ended(Event, frozen=True):
    """The end of a step."""

    robot: int


class Turn(Event, frozen=True):
    """The turn of a robot in a tick. In a live run a turn takes no time."""

    robot: int


class Goes(Event, frozen=True):
    """A tick in which a robot is in transit."""

    robot: int


class Time(Change, frozen=True):
    """A new time of the run. With it, charges of resting robots change in a live run (in lockstep
    they change with each stay)."""

    now: float


class Departed(Event, frozen=True):
    """A robot departs for a pose. ``by``: the origin of the decision; ``node``: its strategy's node
    there, with the ``values`` of its formulas; ``due``: the tick in which the step ends, if it
    takes several; live: the number of its ``command`` and the expected ``seconds``."""

    robot: int
    pose: int
    by: str
    node: int | None = None
    due: int | None = None
    command: int = 0
    seconds: float | None = None
    values: Values | None = None


class Arrived(Ended, frozen=True):
    """A robot has arrived in the commanded pose. ``why``: the reason for more than one attempt."""

    why: str = ""


class Elsewhere(Ended, frozen=True):
    """A robot's step has ended in another pose. ``blocked``: whether an obstacle stopped it."""

    pose: int
    blocked: bool = False


class Astray(Event, frozen=True):
    """A robot's strategy has no successor for its observation, which violates these assumptions."""

    robot: int
    rules: tuple[str, ...]


class Failed(Ended, frozen=True):
    """A robot's step has failed. ``fatal``: whether it can no longer move."""

    pose: int
    why: str
    fatal: bool = False


class Lost(Ended, frozen=True):
    """A robot is in one of these regions; which one is unknown."""

    regions: frozenset[int]
    why: str = ""


class Stayed(Event, frozen=True):
    """A robot stays for this turn. ``by``: the origin of the decision."""

    robot: int
    by: str
    node: int | None = None
    values: Values | None = None


class Flat(Event, frozen=True):
    """The end of a robot's charge. ``obstacle``: its empty battery, if the scenario has a ``flat``
    type."""

    robot: int
    obstacle: int | None


class Served(Change, frozen=True):
    """A robot goes out of service, or returns to service. ``cause``: the reason."""

    robot: int
    active: bool
    cause: str


class Placed(Change, frozen=True):
    """An operator has placed a robot in a pose."""

    robot: int
    pose: int


class Assigned(Change, frozen=True):
    """A robot gets another own objective. ``cause``: the reason; ``within``: the deadline of each
    round in ticks; ``mode``: the input that selects it; ``base``: the objective without that input;
    ``own``: whether the robot pursued its own objective until now."""

    robot: int
    objective: Objective
    cause: str
    within: int | None = None
    mode: str | None = None
    base: Base | None = None
    own: bool = True


class Looked(Event, frozen=True):
    """A robot has observed the robots that it tracks: its knowledge of each now, and the regions
    where each may be."""

    robot: int
    known: tuple[tuple[int, Known], ...]
    places: tuple[frozenset[int], ...]


class Inputs(Change, frozen=True):
    """The inputs of the environment that are on."""

    on: frozenset[str]
    by_user: tuple[str, ...] = ()


class Declared(Change, frozen=True):
    """An operator has declared an obstacle permanent."""

    obstacle: int


class Intervened(Change, frozen=True):
    """An operator intervenes. ``what``: the word for the intervention."""

    what: str
    robot: int | None = None
    obstacle: int | None = None
    pose: Pose | None = None
    objective: Objective | None = None


class Late(Change, frozen=True):
    """The run drops a report of the world or a change, of this kind and for this reason."""

    kind: str
    why: str
    robot: int | None = None
    obstacle: str | None = None


class Seen(Change, frozen=True):
    """A sensor shows an obstacle for which there is no request yet."""

    obstacle: int


class Acts(Event, frozen=True):
    """A robot begins an action on obstacles where it stands, with this group, as a command."""

    robot: int
    group: tuple[int, ...]
    command: int
    obstacles: tuple[int, ...]


class Acted(Event, frozen=True):
    """A robot has done all that it can where it stands. ``stages``: the changed stages; ``truths``:
    the truth that each resolved obstacle revealed; ``failed``: the obstacles that it failed to
    resolve; ``gone``: the obstacles that it did not find; ``why``: the reason of a failure;
    ``again``: the obstacles that a sensor showed again and that it resolved without a request."""

    robot: int
    stages: tuple[tuple[int, Stage], ...]
    truths: tuple[tuple[int, bool | None], ...]
    failed: tuple[int, ...] = ()
    gone: tuple[int, ...] = ()
    command: int = 0
    why: str = ""
    again: tuple[int, ...] = ()


class Introduced(Change, frozen=True):
    """The team gets an obstacle that the scenario does not list: one that was noticed, or the empty
    battery of a robot."""

    source: model.Obstacle
    battery_of: int | None = None


class Met(Event, frozen=True):
    """A robot has encountered an obstacle on a step to ``pose``. ``stopped``: whether it had begun
    that step, and stands where it began."""

    robot: int
    obstacle: int
    pose: int
    stopped: bool = False


class Appeared(Change, frozen=True):
    """An obstacle appears. ``truth``: what its resolution will reveal in a simulated world, if
    that differs from the truth of the last obstacle with this name."""

    obstacle: int
    truth: bool | None = None
    cause: str = "scenario"


class Gone(Change, frozen=True):
    """An obstacle has disappeared, or was found to be gone. ``cause``: the reason."""

    obstacle: int
    cause: str = "scenario"


class Counted(Event, frozen=True):
    """A robot's turn is over: goals count where it stands. ``at_once``: its turn takes no time,
    so staying counts immediately; ``duty``: whether goals of its duty count also."""

    robot: int
    at_once: bool = False
    duty: bool = True


class GaveUp(Event, frozen=True):
    """A decision: no robot can ever resolve an obstacle."""

    obstacle: int


class Reopened(Event, frozen=True):
    """A decision: given-up obstacles, and requests that were set aside, are tried again."""


class SetAside(Event, frozen=True):
    """A decision: no joint plan serves these requests."""

    obstacles: tuple[int, ...]


class Told(Event, frozen=True):
    """A decision: a robot pursues an objective, from ``node`` of its strategy on, where its
    formulas have these ``values``."""

    robot: int
    objective: Objective
    node: int | None = None
    values: Values | None = None


class Turned(Event, frozen=True):
    """A decision: a robot begins its round with this target."""

    robot: int
    memory: int


class Planned(Event, frozen=True):
    """A decision: the robots of joint plans follow this plan."""

    plan: Plan | None


Strayed = Elsewhere | Failed | Lost | Met
"""Ends of steps that differ from the decision; further changes may follow."""
