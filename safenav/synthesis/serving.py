"""A strategy that nobody lists: slugs keeps its diagrams and answers one move at a time.

    with serve(specification) as strategy:
        here = strategy.start({"region": 3})
        there = strategy.move(here, {"request": 1})

The moves are those of the listed strategy. Each position comes with a measure: whoever follows
can check that on a move which does not meet the pursued goal the distance falls, or that it
stays and the named assumption does not hold on this move. The process ends with its owner: when
the strategy is closed, and at the end of its input should the owner die.
"""

from __future__ import annotations

import json
import selectors
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from safenav.errors import SynthesizerError
from safenav.spec.specification import Owner, Specification
from safenav.synthesis.answer import failure, verdict_of
from safenav.synthesis.binary import Binary, find_own_binary
from safenav.synthesis.process import Finished, kill_group
from safenav.synthesis.strategy import Field, locate
from safenav.synthesis.verdict import Verdict

PROTOCOL = 1
_OVERTIME_SECONDS = 1.0
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Measure:
    """How far a position is from its goal: ``assumption`` is the index of the ENV_LIVENESS line
    that may be waited for here, None if nothing excuses waiting."""

    distance: int
    assumption: int | None


@dataclass(frozen=True)
class Position:
    """A state (all variables: integers as they are, Booleans as 0 and 1) with the index of the
    SYS_LIVENESS line that is pursued."""

    values: Mapping[str, int]
    goal: int
    measure: Measure


@dataclass(frozen=True)
class Move:
    """Where the strategy goes; ``met``: how many goals in turn this very move meets, beginning
    with the one that was pursued."""

    to: Position
    met: int


def falls(before: Position, move: Move, assumption_holds: bool) -> bool:
    """Whether a move keeps the promise of the measure. ``assumption_holds``: whether the
    assumption that ``before`` names holds on this move."""
    old, new = before.measure, move.to.measure
    return (
        move.met > 0
        or new.distance < old.distance
        or (new == old and old.assumption is not None and not assumption_holds)
    )


class ServedStrategy:
    """The running process; closing it, or leaving its ``with`` block, ends it.

    Used by one thread. ``seconds`` limits each answer (wall). Every method raises
    SynthesizerError if the process has ended, takes too long or answers nonsense.
    """

    def __init__(
        self, talk: _Talk, specification: Specification, greeting: Mapping[str, Any]
    ) -> None:
        self.specification = specification
        names = greeting["variables"]
        self._talk = talk
        self._fields = locate(names, specification)
        self._width = len(names)
        self._inputs = [names.index(name) for name in greeting["inputs"]]
        self._outputs = [names.index(name) for name in greeting["outputs"]]
        self._names: Sequence[str] = names

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._talk.pid

    def start(self, values: Mapping[str, int]) -> Position | None:
        """The first initial state with these values (of any variables); None without one."""
        given: dict[str, int] = {}
        for field in self._fields:
            if field.variable.name in values:
                bits = field.encode(values[field.variable.name])
                if bits is None:
                    return None
                given |= {self._names[column]: bit for column, bit in bits}
        answer = self._talk.ask({"start": given})
        if answer.get("state", ()) is None:
            return None
        return self._position(self._bits(answer, "state", self._width), answer)

    def move(self, here: Position, inputs: Mapping[str, int]) -> Move | None:
        """What the strategy does about these next inputs (all of them); None if the environment
        did what the assumptions exclude. Raises KeyError for a missing input."""
        state = [0] * self._width
        following = [0] * self._width
        for field in self._fields:
            name = field.variable.name
            _put(field, here.values[name], state)
            if field.variable.owner is Owner.INPUT and not _put(field, inputs[name], following):
                return None
        given = [following[column] for column in self._inputs]
        answer = self._talk.ask({"state": state, "goal": here.goal, "inputs": given})
        if "refused" in answer:
            if answer["refused"] == "inputs":
                return None
            raise SynthesizerError(
                f"the synthesizer refuses the {answer['refused']}: it is no state of its strategy"
            )
        for column, bit in zip(
            self._outputs, self._bits(answer, "outputs", len(self._outputs)), strict=True
        ):
            following[column] = bit
        met = answer.get("met")
        if not isinstance(met, int):
            raise self._talk.nonsense(answer)
        return Move(self._position(following, answer), met)

    def close(self) -> None:
        """End the process."""
        self._talk.close()

    def __enter__(self) -> ServedStrategy:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _position(self, state: Sequence[int], answer: Mapping[str, Any]) -> Position:
        goal, distance, assumption = (answer.get(k) for k in ("goal", "distance", "assumption"))
        if (
            not isinstance(goal, int)
            or not isinstance(distance, int)
            or not isinstance(assumption, int | None)
        ):
            raise self._talk.nonsense(answer)
        values = {field.variable.name: field.decode(state) for field in self._fields}
        return Position(values, goal, Measure(distance, assumption))

    def _bits(self, answer: Mapping[str, Any], key: str, count: int) -> list[int]:
        bits = answer.get(key)
        if not isinstance(bits, list) or len(bits) != count or not set(bits) <= {0, 1}:
            raise self._talk.nonsense(answer)
        return bits


def serve(
    specification: Specification,
    binary: Binary | None = None,
    *,
    seconds: float | None = 60.0,
    memory_mb: int | None = 2048,
    answer_seconds: float = 60.0,
) -> ServedStrategy | Verdict:
    """Solve, and keep the process for moves; any verdict but realizable is returned as such.

    ``seconds`` (wall) and ``memory_mb`` limit the solving, ``answer_seconds`` each later answer.
    Raises SynthesizerError if safenav's own binary is missing or breaks.
    """
    binary = binary or find_own_binary()
    if binary is None or not binary.native:
        raise SynthesizerError(
            "safenav's own slugs binary, which serves strategies, is missing: run `make slugs` "
            "or `pip install .`"
        )
    command = [str(binary.path)]
    if seconds is not None:
        command += ["--timeout", f"{seconds:g}"]
    if memory_mb is not None:
        command += ["--memory", str(memory_mb)]
    # The program's standard input is for requests, so the specification is a file.
    with tempfile.TemporaryDirectory(prefix="safenav-") as directory:
        file = Path(directory) / "specification.structuredslugs"
        file.write_text(specification.to_structuredslugs(), encoding="utf-8")
        begun = time.monotonic()
        talk = _Talk([*command, "--serve", str(file)], answer_seconds)
        try:
            line = talk.hear(None if seconds is None else begun + seconds + _OVERTIME_SECONDS)
            if line is None:
                ended = talk.ended(begun)
                verdict = verdict_of(ended, binary, specification.robot)
                if verdict is Verdict.REALIZABLE:
                    raise failure("serves no strategy", ended, binary, specification.robot)
                return verdict
            greeting = talk.parsed(line)
            if greeting.get("protocol") != PROTOCOL:
                raise talk.nonsense(greeting)
            return ServedStrategy(talk, specification, greeting)
        except TimeoutError:
            talk.close()
            return Verdict.TIMEOUT
        except BaseException:
            talk.close()
            raise


class _Talk:
    """Lines to and from the process."""

    def __init__(self, command: Sequence[str], seconds: float) -> None:
        self._program = command[0]
        self._seconds = seconds
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (closed in close)
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                start_new_session=True,
                bufsize=0,
            )
        except OSError as error:
            self._errors.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} cannot be started: {error.strerror}"
            ) from error
        self._selector = selectors.DefaultSelector()
        assert self._process.stdin and self._process.stdout
        self._given, self._output = self._process.stdin, self._process.stdout
        self._selector.register(self._output, selectors.EVENT_READ)
        self._heard = b""
        self._closed = False

    @property
    def pid(self) -> int:
        return self._process.pid

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a request."""
        if self._closed:
            raise SynthesizerError(f"the synthesizer {self._program} has been closed")
        try:
            self._given.write(json.dumps(request).encode() + b"\n")
            line = self.hear(time.monotonic() + self._seconds)
        except TimeoutError:
            self.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} gave no answer within {self._seconds:g} s"
            ) from None
        except BrokenPipeError:
            line = None
        if line is None:
            self._process.wait()
            status = self._process.returncode
            words = self._last_words()
            self.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} ended while it served a strategy (exit status "
                f"{status})\n    it said last: {words or 'nothing'}"
            )
        answer = self.parsed(line)
        if "error" in answer:
            raise SynthesizerError(
                f"the synthesizer {self._program} does not understand a request: {answer['error']}"
            )
        return answer

    def hear(self, deadline: float | None) -> bytes | None:
        """The next line, None at the end. Raises TimeoutError."""
        while b"\n" not in self._heard:
            left = None if deadline is None else deadline - time.monotonic()
            if (left is not None and left <= 0) or not self._selector.select(left):
                raise TimeoutError
            data = self._output.read(_CHUNK)
            if not data:
                return None
            self._heard += data
        line, _, self._heard = self._heard.partition(b"\n")
        return line

    def parsed(self, line: bytes) -> dict[str, Any]:
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise self.nonsense(line[:200])
        return answer

    def nonsense(self, answer: object) -> SynthesizerError:
        return SynthesizerError(f"the synthesizer {self._program} answers nonsense: {answer!r}")

    def ended(self, begun: float) -> Finished:
        """What it left behind, after its output has ended."""
        status = self._process.wait()
        self._errors.seek(0)
        errors = self._errors.read()
        self.close()
        return Finished(status, b"", errors, time.monotonic() - begun)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        kill_group(self._process)
        self._selector.close()
        self._given.close()
        self._output.close()
        self._process.wait()
        self._errors.close()

    def _last_words(self) -> str:
        self._errors.seek(0)
        return self._errors.read().decode("utf-8", "replace").strip().rpartition("\n")[2][:500]


def _put(field: Field, value: int, state: list[int]) -> bool:
    """Write a value's bits; False if the variable cannot hold it."""
    bits = field.encode(int(value))
    for column, bit in bits or ():
        state[column] = bit
    return bits is not None
