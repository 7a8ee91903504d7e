"""The run of a scenario without its hidden obstacles, for a check before the real run."""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.run.mission import Mission, RunResult, uninterrupted
from safenav.scenario.model import Scenario
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause


class Rehearsal(Struct, frozen=True):
    """The ``result`` of such a run; ``late``: the missed deadlines; ``flat``: the tick in which
    each empty battery took its robot out of service."""

    result: RunResult
    late: tuple[str, ...]
    flat: dict[str, int]


def rehearse(scenario: Scenario, synthesizer: Synthesizer) -> Rehearsal:
    """Run a scenario without hidden obstacles: only its orders remain."""
    late, flat = tuple[str, ...](), dict[str, int]()

    def heard(record: records.Record) -> None:
        nonlocal late
        if isinstance(record, records.End):
            late = record.late or ()
        elif isinstance(record, records.Service) and record.cause is ChangeCause.BATTERY:
            flat.setdefault(record.robot, record.tick)

    orders = tuple(obstacle for obstacle in scenario.obstacles if obstacle.ordered)
    mission = Mission(replace(scenario, obstacles=orders), synthesizer, listeners=[heard])
    result = uninterrupted(mission.run())
    return Rehearsal(result, late, flat)
