"""Every trace line of an event has one sentence, the same in all outputs."""

import pytest
from msgspec.structs import replace

from safenav.run.wording import Wording
from safenav.trace import records
from safenav.trace.records import KINDS
from traces.examples import examples

SILENT = {"header", "move", "hold", "backtrack", "belief", "checkpoint", "discovered"}
"""What happens in every tick, or belongs to another line's sentence."""


@pytest.mark.parametrize("seed", range(10))
def test_every_event_has_one_sentence(seed: int) -> None:
    told = set()
    for record in examples(seed):
        if record.type in SILENT:
            with pytest.raises(TypeError, match="is not an event"):
                Wording().sentence(record)
            continue
        sentence = Wording().sentence(record)
        assert sentence and "\n" not in sentence and not sentence.endswith(".")
        assert "None" not in sentence
        told.add(record.type)
    assert told == set(KINDS) - SILENT


def test_regions_and_robots_are_shown_by_the_given_functions() -> None:
    names = {46: "gate", 47: "dock"}
    wording = Wording(
        word=lambda region: names.get(region, str(region)),
        place=lambda region: f"{names[region]} {region}",
        robot=str.upper,
        strong=lambda word: f"*{word}*",
    )
    violation = records.Violation(3, "quad", 46, 47, "door@47", "push")
    told = "QUAD at gate 46 finds *a door* at dock 47 and keeps out: it lacks 'push'"
    assert wording.sentence(violation) == told
    request = records.Request(3, "door@47", "quad", {"digit": 1, "rover": None}, ("digit",))
    told = "QUAD requests help with door@dock: digit needs 1 tick, rover cannot come"
    assert wording.sentence(request) == f"{told}; DIGIT helps"
    live = replace(request, t=3.5)  # ticks of the slowest step are no time there
    assert "digit bids 1, rover cannot come" in wording.sentence(live)
    failed = replace(request, because="rover has failed")
    assert wording.sentence(failed).endswith("; DIGIT helps, since rover has failed")
    second = records.Request(3, "door@47", "quad", {"digit": 1}, ("digit",), need=1)
    assert wording.sentence(second).startswith("QUAD requests help with door@dock (need 2): ")
    met = records.Met(5, "door@47", 0, "sense", "quad", 46)
    assert wording.sentence(met) == "QUAD at gate 46 fulfils need 1 of *door@dock*: sense"
    both = records.Resolved(5, "beam@47", "digit", 46, False, None, robots=("digit", "rover"))
    assert wording.sentence(both) == (
        "DIGIT at gate 46 resolves *beam@dock* with ROVER (without a request)"
    )
    several = replace(wording, actions={"beam@47": ["sense", "lift"]})  # rover has sensed
    told = "DIGIT at gate 46 resolves *beam@dock* (without a request)"
    assert several.sentence(both) == told
