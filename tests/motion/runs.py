"""Traces of shipped scenarios, each run once for all tests of motion."""

from functools import cache
from pathlib import Path

from msgspec.structs import replace

from once import SCENARIOS, made_once, trace_of_shipped
from runtime.played import play
from safenav import Clock, Trace, load_scenario, motion_of
from safenav.motion.file import Motion, parsed, text_of
from safenav.trace.file import read_bytes
from support.durations import Uneven

SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))


@cache
def trace_bytes(name: str) -> bytes:
    """The trace of a shipped scenario, as its file."""
    return trace_of_shipped(name).read_bytes()


def played(text: str) -> bytes:
    """The trace of a scenario that is given as text."""
    return "".join(play(text).lines).encode()


@cache
def live_trace(name: str, delayed: float = 0.0) -> bytes:
    """The trace of a shipped scenario with a clock; a share of its steps takes longer."""
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    world = Uneven(scenario, delayed=delayed, factor=1.7)
    return "".join(play(scenario, world=world).lines).encode()


@cache
def trace_of(name: str) -> Trace:
    return read_bytes(trace_bytes(name), f"{name}.jsonl")


@cache
def motion(name: str) -> Motion:
    """The motion of a shipped scenario, as a reader of its file has it."""
    file = f"{name}.motion.jsonl"

    def make(folder: Path) -> None:
        made = motion_of(trace_of(name))
        (folder / file).write_bytes(text_of(made).encode())

    return parsed((made_once(f"motion of {name}", make) / file).read_bytes(), file)
