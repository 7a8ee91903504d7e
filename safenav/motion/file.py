"""The motion file: its lines as typed data (docs/motion_file.md), its reader and its writer.

Positions are in the frame of the map: x east, y north, z up, the origin at its south-western
corner, in metres. ``t``, ``t0`` and ``t1`` are seconds since the start of the motion. Angles are
radians counter-clockwise from east. ``tick`` is the tick of the trace that a line carries out. A
``row`` is the list of its fields. The reader skips unknown fields and lines of unknown types.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from msgspec import Meta, Struct, field, to_builtins

from safenav.errors import Diagnostic, InputError
from safenav.files import check_kind, json_flaw, json_line, read_input
from safenav.pace.gait import frequency
from safenav.scenario.model import Robot
from safenav.strict_json import read_json
from safenav.trace.fields import WrongError, convert

VERSION = 1

State = tuple[float, float, float, float]
"""x, y, vx, vy."""
Numbers = tuple[float, ...]
Polynomial = Annotated[Numbers, Meta(max_length=8)]
"""Coefficients of a polynomial. Their number is limited, since each one adds samples to checks."""
SOME = Meta(min_length=1)
Positive = Annotated[float, Meta(gt=0)]
LONGEST = 2_000_000
"""Maximum duration of a motion in seconds (23 days), since checks sample all of it."""
FootState = tuple[float, float, float, float, float, float, float, float, float]
"""x, y and yaw, their velocities, their accelerations."""


class MotionHeader(Struct, frozen=True, kw_only=True, tag="header"):
    """A header. ``trace``: the trace's sha256; ``side``: metres of a region; ``origin``: x, y and
    yaw of the map's south-western corner in the world; ``robots``: for each the ``kind`` of its
    motion, its parameters and its limits; ``motion``: the version of the format."""

    motion: int = VERSION
    trace: str
    safenav: str
    side: Positive
    rows: int
    cols: int
    origin: tuple[float, float, float]
    robots: Mapping[str, Mapping[str, object]]


BUILD = {
    "step": 0.65,
    "aside": 0.2,
    "friction": 0.45,
    "swing": 3.0,
    "stance": 0.45,
    "sole_length": 0.2,
    "sole_width": 0.09,
    "least_double": 0.15,
    "most_double": 0.25,
}
"""The limits of a walker in the header of a motion (docs/models.md): the longest step (m); the
least sideways distance of a landing foot from the other (m); the required friction (of the ground's
normal force); the fastest swing (m/s); the largest distance of the mass from a foot that carries it
(m, on the ground); the size of a sole (m); bounds of the share of walking with both feet on the
ground."""


def limits_of(height: float) -> dict[str, float]:
    """Return the limits of a walker whose mass has this height, and ``omega`` of its pendulum."""
    return {**BUILD, "omega": frequency(height)}


def described(robot: Robot) -> dict[str, object]:
    """Return the entry of a robot in the header; empty if it has no motion in metres."""
    if (figures := robot.model.figures) is None:
        return {}
    own = limits_of(figures.walker.height) if figures.kind == "walker" else {}
    return {**own, "kind": figures.kind, **figures.values, "layer": robot.model.layer}


class Foothold(Struct, frozen=True, array_like=True):
    """A foot on the ground from ``down`` to ``up``; ``side``: 1 is the left foot, -1 the right."""

    x: float
    y: float
    yaw: float
    side: int
    down: float
    up: float


class Swing(Struct, frozen=True, array_like=True):
    """A foot in the air. x, y and yaw are quintics in time between ``start`` and ``goal``
    (positions, velocities, accelerations: nine numbers); the height is 64 clearance u^3 (1-u)^3
    with u from ``u0`` to ``u1``."""

    side: int
    t0: float
    t1: float
    u0: float
    u1: float
    start: FootState
    goal: FootState


class PressurePhase(Struct, frozen=True, array_like=True):
    """The centre of pressure, going from ``x``, ``y`` to ``to_x``, ``to_y`` at constant speed."""

    seconds: Positive
    x: float
    y: float
    to_x: float
    to_y: float


class Moving(Struct, frozen=True):
    """A piece of motion, which defines its robot's position at every instant. Successive pieces
    leave no gap."""

    robot: str
    tick: int
    primitive: str
    origin: int = field(name="from")
    to: int
    t0: float
    t1: float


class Segment(Moving, frozen=True, tag="segment"):
    """A piece of a walk. ``turning``: yaw before, yaw after, and the times between which the body
    turns; ``start``, ``goal``: states of the centre of mass."""

    phases: Annotated[tuple[PressurePhase, ...], SOME]
    feet: tuple[Foothold, ...]
    swings: tuple[Swing, ...]
    turning: tuple[float, float, float, float]
    start: State
    goal: State


class Curve(Struct, frozen=True, array_like=True):
    """Polynomials in the seconds since the curve's start, lowest power first."""

    seconds: float
    x: Polynomial
    y: Polynomial
    z: Polynomial
    yaw: Polynomial


class Flight(Moving, frozen=True, tag="flight"):
    """A flyer's reference, or the path of a disc or a rover."""

    parts: Annotated[tuple[Curve, ...], SOME] = field(name="curves")


TrackRow = Annotated[Numbers, Meta(min_length=14, max_length=14)]
"""Position, velocity, quaternion (w, x, y, z), body rates (rad/s), thrust (N)."""


class FlownTrack(Struct, frozen=True, tag="track"):
    """The simulated flight of a flyer along its references. Its rows are ``step`` seconds apart
    from ``t0`` on."""

    robot: str
    t0: float
    step: float
    rows: Annotated[tuple[TrackRow, ...], SOME]


class Reserve(Struct, frozen=True, tag="reserve"):
    """Reservation of the region by the robot from ``t`` on."""

    robot: str
    region: int
    t: float


class Release(Struct, frozen=True, tag="release"):
    """End of a reservation at ``t``."""

    robot: str
    region: int
    t: float


class Action(Struct, frozen=True, tag="action"):
    """An action of a robot on an obstacle, which counts as resolved from ``t1`` on."""

    robot: str
    tick: int
    action: str
    obstacle: str
    region: int
    t0: float
    t1: float


class MotionOutcome(Struct, frozen=True, tag="outcome"):
    """The end of the motion."""

    makespan: Annotated[float, Meta(ge=0, le=LONGEST)]


Line = Moving | FlownTrack | Reserve | Release | Action
TYPES: Mapping[object, type[Struct]] = {
    kind.__struct_config__.tag: kind
    for kind in (MotionHeader, Segment, Flight, FlownTrack, Reserve, Release, Action, MotionOutcome)
}
"""The lines of a file by their ``type``."""
L = TypeVar("L")


class Motion(Struct, frozen=True):
    """A whole motion file. ``lines``: in the order of their times."""

    header: MotionHeader
    lines: tuple[Line, ...]
    outcome: MotionOutcome

    def of(self, kind: type[L], robot: str | None = None) -> list[L]:
        """Return the lines of a kind, in the file's order: of one robot or of all robots."""
        return [
            line
            for line in self.lines
            if isinstance(line, kind) and (robot is None or line.robot == robot)
        ]


_DIAGNOSTIC_LIMIT = 20


def read_motion(path: Path) -> Motion:
    """Return the motion in a file. Raises InputError if it cannot be read or is not a motion."""
    content = read_input(path)
    check_kind(content[:4000], "motion file", str(path))
    return parsed(content, str(path))


def parsed(content: bytes, source: str) -> Motion:
    """Return the motion in the bytes of a file. Raises InputError with up to twenty diagnostics."""
    header: MotionHeader | None = None
    outcome: MotionOutcome | None = None
    lines: list[Line] = []
    wrong: list[Diagnostic] = []
    number = 1
    for number, line in enumerate(content.split(b"\n"), start=1):
        if not line.strip():
            continue
        try:
            data = read_json(line)
            kind = data.get("type") if isinstance(data, dict) else None
            if header is None:
                header = _header(data, kind)
            elif kind == "outcome":
                outcome = convert(MotionOutcome, data)
            elif isinstance(kind, str) and kind in TYPES and kind != "header":
                lines.append(convert(TYPES[kind], data))
        except ValueError as error:
            found = f"this line is not JSON: {json_flaw(error)}"
            wrong.append(Diagnostic(source, number, 1, found))
        except WrongError as error:
            wrong.append(Diagnostic(source, number, 1, str(error)))
        if header is None or len(wrong) == _DIAGNOSTIC_LIMIT:
            break
    if not wrong and header is None:
        wrong.append(Diagnostic(source, 1, 1, "the file is empty"))
    elif not wrong and outcome is None:
        found = "the file ends without its 'outcome' line: it was cut off"
        hint = "write it again: safenav export TRACE --motion FILE"
        wrong.append(Diagnostic(source, number, 1, found, hint))
    if header is None or outcome is None or wrong:
        raise InputError(wrong)
    return Motion(header, tuple(lines), outcome)


def _header(data: Any, kind: object) -> MotionHeader:
    if kind != "header" or "motion" not in data:
        begins = f'{{"type":"header","motion":{VERSION}'
        raise WrongError(f"the first line must be the header of a motion file: {begins}, ...")
    if data["motion"] != VERSION:
        version = data["motion"]
        raise WrongError(f"motion version {version!r}: this safenav reads {VERSION}")
    header: MotionHeader = convert(MotionHeader, data)
    return header


def text_of(motion: Motion) -> str:
    """Return the text of the file, with exact numbers."""
    return "".join(map(json_line, to_builtins((motion.header, *motion.lines, motion.outcome))))
