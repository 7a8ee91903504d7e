"""Every record that the runtime can write is read back unchanged."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from runtime.played import completed
from safenav.errors import InputError
from safenav.run.checked import check_trace
from safenav.trace.file import TraceWriter, as_data, read_bytes, read_trace
from safenav.trace.records import KINDS, VERSION, Discovered, Header, Record
from traces.examples import examples
from traces.real import NAMES, real_trace


def said(seed: int) -> list[Record]:
    """The header and an example of every other record."""
    found = [
        replace(record, tick=0, trace=VERSION) if isinstance(record, Header) else record
        for record in examples(seed)
    ]
    assert isinstance(found[0], Header)
    return found


@pytest.mark.parametrize("seed", range(20))
def test_every_record_survives_a_round_trip(seed: int, tmp_path: Path) -> None:
    records, file = said(seed), tmp_path / "t.jsonl"
    with TraceWriter(file) as writer:
        for record in records:
            writer(record)
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert {line["type"] for line in lines} == set(KINDS)
    trace = read_trace(file)
    assert [trace.header, *trace.records] == records
    assert [record.line for record in trace.records] == list(range(2, len(lines) + 1))
    (discovered,) = (record for record in records if isinstance(record, Discovered))
    assert discovered.obstacle.name in trace.obstacles


def test_lines_hold_ticks_and_types_and_no_line_numbers(tmp_path: Path) -> None:
    file = tmp_path / "t.jsonl"
    with TraceWriter(str(file)) as writer:
        for record in said(0):
            writer(record)
    header, *lines = (json.loads(line) for line in file.read_text().splitlines())
    assert {*header} - {"cells", "t"} == {"type", "trace", "safenav", "scenario", "world"}
    for line in lines:
        assert list(line)[:2] == ["type", "tick"]
        assert "line" not in line


class Interrupted(Header):
    """A header whose line is interrupted while it is made."""

    @property
    def note(self) -> bool:
        raise KeyboardInterrupt


def test_an_interrupt_before_the_first_line_is_written_leaves_no_file(tmp_path: Path) -> None:
    file = tmp_path / "t.jsonl"
    header = said(0)[0]
    assert isinstance(header, Header)
    interrupted = Interrupted(**{name: getattr(header, name) for name in header.__struct_fields__})
    with pytest.raises(KeyboardInterrupt), TraceWriter(file) as writer:
        writer(interrupted)
    assert not file.exists()


@pytest.mark.parametrize("name", NAMES)
def test_a_real_trace_is_written_as_it_was_read(name: str) -> None:
    trace = read_bytes(real_trace(name).encode())
    assert trace.ignored == 0
    written = [json.dumps(as_data(record)) for record in (trace.header, *trace.records)]
    again = read_bytes("\n".join(written).encode())
    assert (again.header, again.records) == (trace.header, trace.records)


HOSTILE = "\x1b[2J\x07\x9b\u2028\u202e\nx"


def test_names_of_a_trace_that_give_orders_to_the_terminal_are_refused_and_shown_escaped() -> None:
    """Also as keys, and unescaped, as another program may write them."""
    hostile = json.dumps(HOSTILE, ensure_ascii=False)[1:-1]
    for name in ("quad", "door"):
        renamed = real_trace("case_study_1_beliefs").replace(f'"{name}', f'"{name}{hostile}')
        with pytest.raises(InputError) as refused:
            read_bytes(renamed.encode())
        assert all(each.found.isprintable() for each in refused.value.diagnostics)


def test_texts_of_a_trace_give_no_orders_to_the_terminal() -> None:
    """Explanations have lines."""
    lines = real_trace("case_study_1_beliefs").splitlines()
    hostile = json.dumps(HOSTILE, ensure_ascii=False)[1:-1]
    end = '"explanation":"'
    lines[-1] = lines[-1].replace(end, rf"{end}one\ntwo\u001b{hostile}")
    trace = read_bytes("\n".join(lines).encode())
    assert trace.outcome is not None
    shown = r"\x1b[2J\x07\x9b\u2028\u202e"
    assert trace.outcome.explanation.startswith(f"one\ntwo\\x1b{shown}\nx")
    assert check_trace(trace).ok
    said = json.dumps([as_data(record) for record in trace.records], ensure_ascii=False)
    assert said.isprintable()


@pytest.mark.parametrize("reverse", [False, True])
def test_an_obstacle_that_reappears_is_listed_in_any_order(reverse: bool) -> None:
    """The first one is found to be closed, the second one to be open."""
    fog = {"type": "uncertainty", "region": 10}
    listed = [fog | {"traversable": False, "until": 6}, fog | {"from": 9}]
    run = completed(
        {
            "safenav": 1,
            "map": {"grid": ["#######", "#.....#", "#######"]},
            "robots": {
                "spot": {"model": "fetch", "start": 8, "objective": {"visit": [12, 8]}},
                "quad": {"model": "quadcopter", "start": 9, "objective": {"hold": 9}},
            },
            "obstacles": listed[::-1] if reverse else listed,
            "until": {"rounds": 3},
        }
    )
    assert [line["traversable"] for line in run.all("resolved")] == [False, True]
