"""Every trace line of an event has one sentence, the same in all outputs."""

import pytest
from msgspec.structs import replace

from safenav.run.wording import Wording
from safenav.trace import records
from safenav.trace.records import KINDS
from safenav.world.map import RegionMap
from traces.examples import examples

MAP = RegionMap.from_grid(["." * 99], names={"gate": 46, "dock": 47})
SILENT = {"header", "move", "hold", "backtrack", "belief", "checkpoint", "discovered"}
"""What happens in every tick, or belongs to another line's sentence."""


@pytest.mark.parametrize("seed", range(10))
def test_every_event_has_one_sentence(seed: int) -> None:
    told, wording = set(), Wording(MAP)
    for record in examples(seed):
        if record.type in SILENT:
            with pytest.raises(TypeError, match="is not an event"):
                wording.sentence(record)
            continue
        sentence = wording.sentence(record)
        assert sentence and "\n" not in sentence and not sentence.endswith(".")
        assert "None" not in sentence
        told.add(record.type)
    assert told == set(KINDS) - SILENT


def test_regions_are_shown_by_their_names() -> None:
    wording = Wording(MAP, RegionMap.label)
    violation = records.Violation(3, "quad", 46, 47, "door@47", "push")
    told = "quad at gate 46 [0, 46] finds a door at dock 47 [0, 47] and keeps out: it lacks 'push'"
    assert wording.sentence(violation) == told
    request = records.Request(3, "door@47", "quad", {"digit": 1, "rover": None}, ("digit",))
    told = "quad requests help with door@dock: digit needs 1 tick, rover cannot come"
    assert wording.sentence(request) == f"{told}; digit helps"
    live = replace(wording, live=True)  # ticks of the slowest step are no time there
    assert "digit bids 1, rover cannot come" in live.sentence(request)
    failed = replace(request, because="rover has failed")
    assert wording.sentence(failed).endswith("; digit helps, since rover has failed")
    second = records.Request(3, "door@47", "quad", {"digit": 1}, ("digit",), need=1)
    assert wording.sentence(second).startswith("quad requests help with door@dock (need 2): ")
    met = records.Met(5, "door@47", 0, "sense", "quad", 46)
    assert wording.sentence(met) == "quad at gate 46 [0, 46] fulfils need 1 of door@dock: sense"
    both = records.Resolved(5, "beam@47", "digit", 46, False, None, robots=("digit", "rover"))
    assert wording.sentence(both) == (
        "digit at gate 46 [0, 46] resolves beam@dock with rover (without a request)"
    )
    several = replace(wording, actions={"beam@47": ["sense", "lift"]})  # rover has sensed
    told = "digit at gate 46 [0, 46] resolves beam@dock (without a request)"
    assert several.sentence(both) == told
