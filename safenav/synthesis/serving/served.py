"""A strategy that is queried move by move, with a progress measure to check each move.

    with serve(specification) as strategy:
        here = strategy.start({"region": 3})
        there = strategy.move(here, {"request": 1})

The moves are those of the explicit strategy. Each position comes with a progress measure, so the
caller can check a move that does not meet the pursued goal: the distance falls, or it stays while
the named assumption does not hold on this move. The process ends with its owner: when the strategy
is closed or unreferenced, and at the end of its input if the owner dies.
"""

from __future__ import annotations

import tempfile
import time
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct

from safenav.errors import SynthesizerError
from safenav.outcome import Verdict
from safenav.spec.specification import Owner, Specification
from safenav.synthesis.binary import Binary, find_own_binary
from safenav.synthesis.process import OVERTIME_SECONDS, ProcessGroup, limits
from safenav.synthesis.result import failure, verdict_of
from safenav.synthesis.serving.connection import Connection
from safenav.synthesis.strategy import Field, locate

PROTOCOL = 1
_ANSWER_SECONDS = 60.0
"""The limit of each reply once the game is solved (wall)."""


class Position(Struct, frozen=True):
    """A state (all variables: integers as they are, Booleans as 0 and 1) with the index of the
    SYS_LIVENESS line that is pursued, and its ``distance`` from that goal. ``assumption``: the
    index of the ENV_LIVENESS line for which the strategy may wait here, None if it may not wait."""

    values: Mapping[str, int]
    goal: int
    distance: int
    assumption: int | None


class ServedMove(Struct, frozen=True):
    """Move of the strategy; ``met``: number of successive goals that this move meets, from the
    pursued one on."""

    to: Position
    met: int


def falls(before: Position, move: ServedMove, assumption_holds: bool) -> bool:
    """Return whether a move satisfies the progress measure. ``assumption_holds``: whether the
    assumption that ``before`` names holds on this move."""
    new = move.to
    stays = (new.distance, new.assumption) == (before.distance, before.assumption)
    return (
        move.met > 0
        or new.distance < before.distance
        or (stays and before.assumption is not None and not assumption_holds)
    )


class ServedStrategy:
    """The running process; closing it, or leaving its ``with`` block, ends it.

    Used by one thread. ``seconds`` limits each reply (wall). Every method raises SynthesizerError
    if the process has ended, takes too long or replies badly.
    """

    def __init__(
        self, connection: Connection, specification: Specification, greeting: Mapping[str, Any]
    ) -> None:
        self.specification = specification
        names = greeting["variables"]
        self._connection = connection
        weakref.finalize(self, connection.close)
        self._fields = locate(names, specification)
        self._width = len(names)
        self._inputs = [names.index(name) for name in greeting["inputs"]]
        self._outputs = [names.index(name) for name in greeting["outputs"]]
        self._names: Sequence[str] = names

    @property
    def pid(self) -> int:
        """Process id."""
        return self._connection.pid

    def start(self, values: Mapping[str, int]) -> Position | None:
        """Return the first initial state with these values (of any variables), or None."""
        return self._first("start", values)

    def find(self, values: Mapping[str, int], most: int) -> Position | None:
        """Return the first node with these values (of any variables) among the first ``most`` nodes
        of the explicit strategy, or None."""
        return self._first("find", values, {"nodes": most})

    def move(self, here: Position, inputs: Mapping[str, int]) -> ServedMove | None:
        """Return the strategy's move for these next inputs (all of them); None if the environment
        did what the assumptions exclude. Raises KeyError for a missing input."""
        state = [0] * self._width
        following = [0] * self._width
        for field in self._fields:
            name = field.variable.name
            _put(field, here.values[name], state)
            if field.variable.owner is Owner.INPUT and not _put(field, inputs[name], following):
                return None
        given = [following[column] for column in self._inputs]
        answer = self._connection.request({"state": state, "goal": here.goal, "inputs": given})
        if "refused" in answer:
            if answer["refused"] == "inputs":
                return None
            raise SynthesizerError(
                f"the synthesizer refuses the {answer['refused']}: "
                "it is not a state of the strategy"
            )
        for column, bit in zip(
            self._outputs, self._bits(answer, "outputs", len(self._outputs)), strict=True
        ):
            following[column] = bit
        met = answer.get("met")
        if not isinstance(met, int):
            raise self._connection.invalid(answer)
        return ServedMove(self._position(following, answer), met)

    def close(self) -> None:
        """End the process."""
        self._connection.close()

    def __enter__(self) -> ServedStrategy:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _first(
        self, asked: str, values: Mapping[str, int], besides: Mapping[str, int] | None = None
    ) -> Position | None:
        given: dict[str, int] = {}
        for field in self._fields:
            if field.variable.name in values:
                bits = field.encode(values[field.variable.name])
                if bits is None:
                    return None
                given |= {self._names[column]: bit for column, bit in bits}
        answer = self._connection.request({asked: given, **(besides or {})})
        if answer.get("state", ()) is None:
            return None
        return self._position(self._bits(answer, "state", self._width), answer)

    def _position(self, state: Sequence[int], answer: Mapping[str, Any]) -> Position:
        goal, distance, assumption = (answer.get(k) for k in ("goal", "distance", "assumption"))
        if (
            not isinstance(goal, int)
            or not isinstance(distance, int)
            or not isinstance(assumption, int | None)
        ):
            raise self._connection.invalid(answer)
        values = {field.variable.name: field.decode(state) for field in self._fields}
        return Position(values, goal, distance, assumption)

    def _bits(self, answer: Mapping[str, Any], key: str, count: int) -> list[int]:
        bits = answer.get(key)
        if not isinstance(bits, list) or len(bits) != count or not set(bits) <= {0, 1}:
            raise self._connection.invalid(answer)
        return bits


def serve(
    specification: Specification,
    binary: Binary | None = None,
    *,
    options: Sequence[str] = (),
    seconds: float | None = 60.0,
    memory_mb: int | None = 2048,
    crew: ProcessGroup | None = None,
) -> ServedStrategy | Verdict:
    """Solve, and keep the process for moves; return the verdict if it is not realizable.

    ``seconds`` (wall) and ``memory_mb`` limit the solving; meanwhile the process belongs to
    ``crew``. Raises SynthesizerError if safenav's own binary is missing or breaks, DismissedError
    after the crew was dismissed.
    """
    binary = binary or find_own_binary()
    if binary is None or not binary.native:
        raise SynthesizerError(
            "safenav's own slugs binary, which serves strategies, is missing: run `make slugs` "
            "or `pip install .`"
        )
    command = [str(binary.path), *options, *limits(seconds, memory_mb)]
    crew = crew or ProcessGroup()
    begun = time.monotonic()
    # The program's standard input is for requests, so the specification is a file: one without a
    # name, which disappears however this process ends.
    with tempfile.TemporaryFile() as file:
        file.write(specification.to_structuredslugs().encode())
        file.seek(0)
        place = f"/dev/fd/{file.fileno()}"
        command += ["--serve", place]
        connection = Connection(command, _ANSWER_SECONDS, crew, file, binary.ours)
        try:
            line = connection.read_line(
                None if seconds is None else begun + seconds + OVERTIME_SECONDS
            )
            if line is None:
                ended = connection.ended(begun)
                verdict = verdict_of(ended, binary, specification.robot)
                if verdict is Verdict.REALIZABLE:
                    raise failure("serves no strategy", ended, binary, specification.robot)
                return verdict
            greeting = connection.parsed(line)
            if greeting.get("protocol") != PROTOCOL:
                raise connection.invalid(greeting)
            strategy = ServedStrategy(connection, specification, greeting)
        except TimeoutError:
            connection.close()
            return Verdict.TIMEOUT
        except BaseException:
            connection.close()
            raise
    connection.leave_crew()
    return strategy


def _put(field: Field, value: int, state: list[int]) -> bool:
    """Write a value's bits; False if the variable cannot hold it."""
    bits = field.encode(int(value))
    for column, bit in bits or ():
        state[column] = bit
    return bits is not None
