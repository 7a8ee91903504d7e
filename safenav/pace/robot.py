"""Kinds of motion with their parameters, and durations of steps and actions by kind.

The motion of ``safenav export`` takes the same seconds (docs/motion.md), so the motion of a run
with these durations shows each step at its time. A robot with a motion that is unknown, or
impossible on regions of this size, takes one second per tick of its ``timing``.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from math import atan2, pi, remainder, sqrt, tau

from msgspec import Struct, convert

from safenav.errors import UsageError
from safenav.pace.gait import LEFT, Walker, gait_on, least_side_of, starting, stopping, walking

KINDS: Mapping[str, Mapping[str, float]] = {
    "walker": {
        **{"size": 0.6, "speed": 0.45},
        "height": 0.8,  # height of the centre of mass in metres
        "foot": 0.18,  # metres from the centre line to each foot
        "clearance": 0.12,  # metres between a swinging foot and the ground
    },
    "flyer": {
        **{"size": 0.5, "speed": 1.0},
        "altitude": 2.2,  # metres above the ground
        "tilt": 3.4,  # maximum horizontal acceleration in m/s^2
    },
    "rover": {
        **{"size": 0.6, "speed": 0.8},
        "acceleration": 0.5,  # maximum in m/s^2
        "turning": 1.0,  # maximum rate in radians per second
    },
    "disc": {"size": 0.5, "speed": 0.5},
}
"""Parameters of the built-in kinds by name; a model may set ``size`` and ``speed``."""
BOUNDS = {
    "walker": {"size": (0.1, 2.0), "speed": (0.05, 2.0)},
    "flyer": {"size": (0.05, 5.0), "speed": (0.05, 20.0)},
    "rover": {"size": (0.05, 5.0), "speed": (0.05, 10.0)},
    "disc": {"size": (0.01, 10.0), "speed": (0.01, 20.0)},
}
"""Minima and maxima of the parameters that a model may set."""
MEANINGS = {"size": "diameter of its body in metres", "speed": "maximum speed in metres per second"}

ACTION = 2.0
"""Seconds of an action."""
SIDE = 2.7
"""Default side of a region in metres."""
PEAK = 1.875
"""Maximum speed of a quintic from rest to rest, divided by its mean speed."""
PEAK_ACCELERATION = 10 / sqrt(3)
"""Maximum acceleration of a quintic from rest to rest, divided by distance / seconds^2."""
TURNING = 1.5
"""Radians per second of a disc that turns to face an obstacle."""
ROOM = 0.05
"""Metres inside its region of a robot that stops short of an obstacle there."""
RESERVE = 0.5
"""Share of the tilt limit for a flyer's reference; the rest is for its tracking."""
AT_ONCE = 1e-9
"""Delays in seconds below this are due to rounding: the order of equal sums."""

YAW: Mapping[str, float] = {"east": 0.0, "north": pi / 2, "west": pi, "south": -pi / 2}
"""Headings in radians, counter-clockwise from east."""


class Figures(Struct, frozen=True):
    """The kind of a robot's motion and all its parameters by name."""

    kind: str
    values: Mapping[str, float]

    @property
    def walker(self) -> Walker:
        """The parameters that determine a walker's gait."""
        return convert(self.values, Walker)

    def glide(self, way: float) -> float:
        """Return the seconds of a straight path from rest to rest. A flyer keeps its tilt limit."""
        values = self.values
        pull = RESERVE * values["tilt"] if "tilt" in values else values.get("acceleration")
        return glide(way, values["speed"], pull)

    def turn(self, angle: float) -> float:
        """Return the seconds of a turn by an angle. Only rovers turn on the spot."""
        values = self.values
        if "turning" not in values:
            return PEAK * angle / TURNING
        return glide(angle, values["turning"], values["acceleration"] / (values["size"] / 2))


def resolved(
    motion: str | None, size: float | None, speed: float | None, layer: str
) -> Figures | None:
    """Return the kind of a model's motion with all its parameters: size, speed and defaults.

    Without ``motion``, a model of the layer ``air`` flies if its size and speed allow that, and any
    other model with a speed is a disc. None without motion and speed.
    """
    own = {name: value for name, value in (("size", size), ("speed", speed)) if value}
    limits = ((value, *BOUNDS["flyer"][name]) for name, value in own.items())
    flies = layer == "air" and all(low <= value <= top for value, low, top in limits)
    motion = motion or ("flyer" if flies else None if speed is None else "disc")
    return None if motion is None else Figures(motion, {**KINDS.get(motion, {}), **own})


class Pace:
    """The durations of a robot's steps and actions, and its state: its heading and the time of its
    last arrival. Regions are numbered in reading order on a map of ``cols`` columns; times are
    seconds on the clock of the run. Without data in metres, a step takes one second per tick."""

    def __init__(self, cols: int, side: float, heading: str | None, ticks: int = 1) -> None:
        self._cols, self._side, self._ticks = cols, side, ticks
        self.facing = YAW[heading] if heading else 0.0
        self._since = 0.0
        self._settling = 0.0
        self._short = False
        self._next = self.facing
        self._foot = self._then = 0

    def step(self, now: float, origin: int, to: int) -> float:
        """Return the seconds from ``now`` until the robot arrives in the neighbouring region
        ``to``. The caller then calls ``arrived``."""
        self._next = self._direction(origin, to)
        on = self._onwards(self._next) if now <= self._since + AT_ONCE else None
        if on is not None:
            return on
        return max(now, self._since + self._settling) - now + self._fresh(self._next)

    def arrived(self, now: float) -> None:
        """Record the end of the step at its destination."""
        self.facing, self._since, self._settling = self._next, now, self._halting()
        self._short = False
        self._foot = self._then

    def placed(self, now: float, heading: str | None) -> None:
        """Record that an operator has placed the robot."""
        self.facing = self._next = YAW[heading] if heading else self.facing
        self._since, self._settling, self._foot, self._short = now, 0.0, 0, False

    def ready(self, now: float, at: int, region: int) -> float:
        """Return the earliest time at which a robot in region ``at`` is at rest and faces an
        obstacle in ``region``, and so can begin to act."""
        if at == region and self._short and now <= self._since + AT_ONCE:
            return now  # still where it last acted
        begin = max(now, self._since + self._settling)
        if at == region:
            return begin
        before = self.facing
        self.faces(at, region)
        return begin + self._turning(_between(before, self.facing))

    def faces(self, at: int, region: int) -> None:
        """Record that the robot in ``at`` has turned towards ``region`` to act there."""
        if at != region:
            self.facing = self._direction(at, region)

    def acted(self, now: float, at: int, region: int) -> None:
        """Record that the robot has acted at the time ``now``. It acts on an obstacle in its own
        region short of the centre, then moves to the centre."""
        self._short = at == region
        self._since, self._settling = now, self._resuming() if self._short else 0.0
        self.faces(at, region)
        self._foot = 0

    def _direction(self, origin: int, to: int) -> float:
        (row, col), (to_row, to_col) = divmod(origin, self._cols), divmod(to, self._cols)
        return atan2(row - to_row, to_col - col)

    def _fresh(self, way: float) -> float:
        """Return the seconds of a step in this direction from rest."""
        del way
        return float(self._ticks)

    def _onwards(self, way: float) -> float | None:
        """Return the seconds of a step after another one without a halt; None if the robot always
        halts."""
        del way
        return None

    def _halting(self) -> float:
        return 0.0

    def _turning(self, angle: float) -> float:
        del angle
        return 0.0

    def _resuming(self) -> float:
        return 0.0


class WalkerPace(Pace):
    """The pace of a walker. It continues to walk if its next step is decided on arrival; otherwise
    it stops, stands and starts again."""

    def __init__(self, cols: int, side: float, heading: str | None, figures: Figures) -> None:
        super().__init__(cols, side, heading or "east")
        self._gait = gait_on(side, figures.walker)

    def faces(self, at: int, region: int) -> None:
        """Do nothing, since a walker acts without turning."""

    def _fresh(self, way: float) -> float:
        stride = starting(self._gait, _quarters(self.facing, way), LEFT)
        self._then = stride.foot
        return stride.seconds

    def _onwards(self, way: float) -> float | None:
        if not self._foot:
            return None
        stride = walking(self._gait, _quarters(self.facing, way), self._foot)
        self._then = stride.foot
        return stride.seconds

    def _halting(self) -> float:
        return sum(stopping(self._gait))


class GliderPace(Pace):
    """The pace of a body that glides from centre to centre. Discs and flyers turn as they move,
    rovers on the spot before they move."""

    def __init__(self, cols: int, side: float, heading: str | None, figures: Figures) -> None:
        super().__init__(cols, side, heading)
        self._figures, self._rover = figures, figures.kind == "rover"

    def faces(self, at: int, region: int) -> None:
        super().faces(at, region)
        if self._rover and at == region:
            self.facing = self._next

    def _fresh(self, way: float) -> float:
        turn, glide = self._turning(_between(self.facing, way)), self._figures.glide(self._side)
        return turn + glide if self._rover else max(turn, glide)

    def _turning(self, angle: float) -> float:
        return self._figures.turn(angle)

    def _resuming(self) -> float:
        """Return the seconds from an obstacle to the centre. A rover first turns to its path."""
        turn = self._turning(_between(self.facing, self._next)) if self._rover else 0.0
        room = self._side / 2 - self._figures.values["size"] / 2 - ROOM
        return turn + self._figures.glide(max(0.0, room))  # a large robot acts at the centre


def pace_of(
    figures: Figures | None,
    cols: int,
    side: float = SIDE,
    heading: str | None = None,
    ticks: int = 1,
) -> Pace:
    """Return the pace of a robot on regions of ``side`` metres. ``ticks``: its ticks per step."""
    if figures is not None and figures.kind in KINDS:
        kind = WalkerPace if figures.kind == "walker" else GliderPace
        with suppress(UsageError):  # impossible motion on such regions
            return kind(cols, side, heading, figures)
    return Pace(cols, side, heading, ticks)


def least_side(figures: Figures, side: float) -> float | None:
    """Return the minimum side in metres of a robot's regions if ``side`` is less, else None."""
    walks = figures.kind == "walker"
    need = least_side_of(side, figures.walker) if walks else figures.values["size"] + 2 * ROOM
    return need if side < need - AT_ONCE else None


def acted_by(team: Iterable[tuple[Pace, int]], now: float, region: int) -> float:
    """Let robots, each in its region, act together on an obstacle in ``region`` from ``now`` on.
    Return the duration in seconds."""
    paces = [*team]
    end = max(pace.ready(now, at, region) for pace, at in paces) + ACTION
    for pace, at in paces:
        pace.acted(end, at, region)
    return end - now


def glide(way: float, speed: float, pull: float | None = None) -> float:
    """Return the seconds of a quintic from rest to rest over a distance (or an angle), within the
    maximum speed and acceleration."""
    seconds = PEAK * way / speed
    return seconds if pull is None else max(seconds, sqrt(PEAK_ACCELERATION * way / pull))


def _between(before: float, after: float) -> float:
    angle = abs(remainder(after - before, tau))
    return 0.0 if angle < AT_ONCE else angle


def _quarters(before: float, after: float) -> int:
    """Return the quarter turns to the left: -1, 0 or 1, since walkers never turn around."""
    return max(-1, min(1, round(remainder(after - before, tau) / (pi / 2))))
