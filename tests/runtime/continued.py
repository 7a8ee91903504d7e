"""Runs that are resumed before each of their passes."""

from collections.abc import Iterable, Iterator
from itertools import count

from runtime.played import Line, Run, play, prepared
from safenav.files import json_line
from safenav.runtime.run.checkpoint import resumption
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Scenario
from safenav.trace.file import as_data, read_bytes

MOST = 12


def rests(scenario: Scenario, most: int = MOST) -> Iterator[Run]:
    """Play a run; yield the whole trace of each run that is resumed before one of its passes, of
    at most so many. The judge must accept each."""
    whole = 1 + play(scenario).outcome["tick"]
    mission, run = prepared(scenario)
    mission.start()
    for number in count():
        if mission.result is not None:
            return
        if number % (1 + whole // most):
            mission.step()
            continue
        kept = mission._run.kept().checkpoint(len(run.records), run.lines[0].strip().encode())
        trace = read_bytes("".join([*run.lines, json_line(as_data(kept))]).encode())
        rest = Run()
        Mission(scenario, begun=resumption(trace, scenario), listeners=[rest]).run()
        assert not rest.findings, rest.findings
        yield rest
        mission.step()


def moves(records: Iterable[Line]) -> list[tuple[str, int, int, str]]:
    keys = "robot", "from", "to", "by"
    return [tuple(one[key] for key in keys) for one in records if one["type"] == "move"]
