"""Case files: scenarios of which a run once went wrong, or that show a behaviour, with their facts.

The first comment of a file is its story. Its lines ``#:`` are YAML:

- ``TYPE``: fields of all lines of this type, in their order (null: not checked); ``a.b`` is the
  field b of the field a, and ``...WORDS`` are words of a text
- ``some TYPE``, ``no TYPE``, ``3 TYPE``: fields of lines that the trace has, does not have, or has
  so often
- ``in order``: the first lines with these fields, ``[TYPE, FIELDS, INDEX]``, come in this order
- ``explained``, ``left_open``: words of the outcome's explanation, and the orders left open there
- ``story``, ``no story``, ``check``, ``no check``: words that the story of the run has or has not,
  and that ``safenav check`` prints or does not print
- ``notes``: words of the claims that the judge could not judge
- ``certified``: a bundle of the run is accepted, with these words
- ``damaged``: the judge refuses the trace without a ``line`` (``[TYPE, FIELDS, INDEX]``), with
  other ``fields`` of it or without one (``drop``), ``and`` more of these: the words ``found``, the
  broken ``rule``
- ``forged``: likewise, the checker of bundles does not accept the bundle with the damaged trace
- ``cut``: from before each pass on, resumed, the run has the same ``outcome``, or even the same
  ``moves``
- ``waits``: an operator attends the live run, and intervenes with these words at each wait;
  ``says``: with which it intervenes after a tick or pass, or with the data of a page;
  ``refused WORDS > WHY`` is impossible, or data with the reason ``refused``
- ``world``: in which it is played, a class of ``worlds.py``; ``slides``, ``jams``, ``looks``,
  ``faults``, ``speeds``, ``opens``, ``claims``: what goes wrong there; ``there``: words of the
  scenario with others, with which the world differs from it; ``failures``: the policy for them;
  ``lies``: the world may tell what breaks rules
- ``refused``: the scenario is not loaded, or cannot be run; words of the message
- ``scenario``: the shipped one that is played
- ``clocks``: it is played on each of these
- ``or``: it is also played with these words replaced
- ``but``: it is also played with the words ``with`` replaced (default: none), where other
  facts hold (perhaps those of the file, merged); ``clocks``

Unless it has another ``outcome``, the mission is completed. Each trace must pass the judge. An
exhaustive search over joint states, which shares no code with safenav, has decided what the teams
of ``orders`` can do.
"""

import json
from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from msgspec import convert
from msgspec.structs import replace

import warm
from certify.making import files_of, judged, lines_of, rewrite, with_lines
from once import ROOT, SCENARIOS, from_yaml
from runtime import worlds
from runtime.played import Run, begin, loaded, whole
from safenav import (
    Mission,
    SafenavError,
    Scenario,
    Synthesizer,
    TraceWriter,
    UsageError,
    check_trace,
    first_failure,
    make_bundle,
    read_trace,
    resumption,
)
from support.damage import damage, find, fits, value

Facts = dict[str, Any]
PRINTED = {"story": ("run", "-", "--no-map"), "check": ("check", "-")}
SCHEMA = json.loads((ROOT / "docs" / "trace.schema.json").read_text())
FIELDS: dict[str, set[str]] = {
    line["properties"]["type"]["enum"][0]: {*line["properties"]}
    for line in SCHEMA["$defs"].values()
    if "enum" in line.get("properties", {}).get("type", {})
}
"""The fields of each type of lines."""
WRONG = ("slides", "jams", "looks", "faults", "speeds", "opens", "claims")
CASES = Path(__file__).parent / "cases"
RESTS = 6
"""Most passes of a run before which it is resumed."""


def read_case(file: Path) -> tuple[str, Facts]:
    """Return the scenario and the facts of a case file."""
    lines = file.read_text().splitlines(keepends=True)
    facts = from_yaml("".join(line[3:] for line in lines if line.startswith("#:"))) or {}
    text = "".join(line for line in lines if not line.startswith("#:"))
    shipped = facts.pop("scenario", None)
    return (SCENARIOS / f"{shipped}.yaml").read_text() if shipped else text, facts


def case(name: str) -> str:
    """Return the scenario of a case, ``FOLDER/STEM``."""
    return read_case(CASES / f"{name}.yaml")[0]


def cases() -> Iterator[Any]:
    """The scenario and the facts of each run of each case file, as parameters of a test."""
    for file in sorted(CASES.rglob("*.yaml")):
        text, said = read_case(file)
        clocks, others = said.pop("clocks", [""]), said.pop("but", [])
        variants = [(change, clocks, said) for change in [{}, *said.pop("or", [])]]
        variants += [(each.pop("with", {}), each.pop("clocks", clocks), each) for each in others]
        for change, played, facts in variants:
            facts = {key: facts[key] for key in facts if key not in ("scenario", "but")}
            for clock in played:
                changed = f"{text}clock: {clock}\n" if clock else text
                for was, now in change.items():
                    assert was in changed, (file, was)
                    changed = changed.replace(was, now)
                name = " ".join(filter(None, [file.stem, clock, *change.values()]))
                yield pytest.param(changed, facts, id=name)


def hold(text: str, facts: Facts) -> Run | None:
    """Check the facts about a scenario and its run, if there is one; return the run."""
    facts = dict(facts)
    if "refused" in facts:
        with pytest.raises(SafenavError) as error:
            Mission(loaded(text))
        _has(str(error.value), facts["refused"])
        return None
    run = staged(text, facts)
    edits = facts.pop("damaged", ())
    cut = facts.pop("cut", None)
    forged, proven = facts.pop("forged", ()), facts.pop("certified", ())
    if said := facts.pop("notes", ()):
        _has("\n".join(map(str, check_trace(run.lines).notes)), said)
    _printed(text, facts)
    _recorded(run, facts)
    for edit in edits:
        told = _damaged(run, edit).findings
        assert told
        broken = f": {edit['rule']} (tick" if "rule" in edit else ""
        _has(told, [edit.get("found", ""), broken])
    if cut:
        _cut(run, text, cut)
    if forged or proven:
        with TemporaryDirectory() as folder:
            trace, synthesizer = "".join(run.lines).encode(), Synthesizer(verifier=first_failure)
            made = make_bundle(Path(folder) / "bundle", trace, {}, synthesizer)
            said = "\n".join(claim["text"] for claim in made.verdict.claims)
            _has(said, () if proven is True else proven)
            for edit in forged:
                _forged(made.path, edit)
    return run


def staged(text: str, facts: Facts) -> Run:
    """Play a run in the world, and with the operator, that the facts name; the judge must accept
    its trace, except where the world lies."""
    waits, lies = facts.pop("waits", None), facts.pop("lies", False)
    about = {key: facts.pop(key) for key in WRONG if key in facts}
    kind = facts.pop("world", "Faulty" if "faults" in about else None)
    scenario = loaded(text)
    failures = convert(facts.pop("failures", {}), type(scenario.failures))
    scenario = replace(scenario, failures=failures)
    for was, is_ in facts.pop("there", {}).items():
        assert was in text, was
        text = text.replace(was, is_)
    world = getattr(worlds, kind)(loaded(text), **about) if kind else None
    mission, run = begin(scenario, world=world, attended=waits is not None)
    left, says = list(waits or ()), facts.pop("says", {})
    while mission.result is None:
        for line in says.get(mission.tick, ()):
            _intervene(mission, line)
        if waits is not None and mission.waiting is not None and mission.still:
            assert left or mission.tick <= max(says, default=0) or isinstance(world, worlds.Clocked)
            for line in left.pop(0) if left else ():
                _intervene(mission, line)
        mission.step()
    assert lies or not run.findings, run.findings
    assert not left
    return run


def _intervene(mission: Mission, line: str | Facts) -> None:
    """Intervene with these words or data; words are refused if they begin so: ``refused WORDS >
    WHY``, data if they have the key ``refused``."""
    wanted, why = line, ""
    if isinstance(line, str):
        wanted, _, why = line.removeprefix("refused ").partition(" > ")
    elif "refused" in line:
        wanted, why = {key: line[key] for key in line if key != "refused"}, line["refused"]
    if not why:
        mission.intervene(wanted)
        return
    with pytest.raises(UsageError) as error:
        mission.intervene(wanted)
    assert why in str(error.value), error.value


def _has(text: str, words: Iterable[str], without: Iterable[str] = ()) -> None:
    assert all(each in text for each in words), text
    assert not any(each in text for each in without), text


def _printed(text: str, facts: Facts) -> None:
    """Check the story of the run, and what ``safenav check`` prints about the scenario."""
    for key, words in PRINTED.items():
        if key in facts or f"no {key}" in facts:
            said = warm.safenav(*words, text=whole(text), together=True).stdout
            _has(said, facts.pop(key, ()), facts.pop(f"no {key}", ()))


def _recorded(run: Run, facts: Facts) -> None:
    """Check the lines of the trace."""
    _has(run.outcome["explanation"], facts.pop("explained", ()))
    assert run.still_open == facts.pop("left_open", run.still_open)
    ordered = [find(run.records, *one) for one in facts.pop("in order", ())]
    assert ordered == sorted(ordered), ordered
    for what, rows in ({"outcome": [{"outcome": "completed"}]} | facts).items():
        some, _, kind = what.rpartition(" ")
        assert {key.partition(".")[0] for row in rows or () for key in row} <= FIELDS[kind], what
        for row in rows if some else ():
            found = sum(fits(line, row) for line in run.all(kind))
            expected = {"some": found > 0, "no": found == 0}
            assert expected[some] if some in expected else found == int(some), (what, row, found)
        if not some and rows is not None:
            lines = run.all(kind)
            assert len(lines) == len(rows), (what, lines)
            for row, line in zip(rows, lines, strict=True):
                assert fits(line, row), (row, {key: value(line, key) for key in row})


def _forged(bundle: Path, edit: Facts) -> None:
    """The checker refuses the bundle with the damaged trace, or cannot judge it."""
    files = files_of(bundle)
    run = _damaged(Run(lines_of(files)), edit)
    with TemporaryDirectory() as folder:
        forged = rewrite(with_lines(files, run.records), Path(folder))
        status, told = judged(forged)
    assert status and edit["found"] in told, told


def _damaged(run: Run, edit: Facts) -> Run:
    """The run after an edit of its lines, and more of them (see ``support.damage``)."""
    return Run(damage(run.records, [edit, *edit.get("and", ())]))


def _cut(run: Run, text: str, alike: str) -> None:
    """Check that each rest of the run has its outcome, or the moves of the whole run."""
    for number, rest in enumerate(_rests(loaded(text), run.outcome["tick"])):
        assert not rest.findings, rest.findings
        assert rest.outcome["outcome"] == run.outcome["outcome"], number
        assert alike != "moves" or _moves(rest) == _moves(run), number


def _rests(scenario: Scenario, ticks: int) -> Iterator[Run]:
    """The whole traces of runs that are resumed before some of their passes."""
    for passes in count(1, 1 + (1 + ticks) // RESTS):
        with TemporaryDirectory() as folder, TraceWriter(file := Path(folder) / "t") as writer:
            mission = Mission(scenario, listeners=[writer], checkpoints=True)
            mission.start()
            while mission.result is None and mission.tick < passes:
                mission.step()
            if mission.result is not None:
                return
            mission.give_up()
            begun = resumption(read_trace(file), scenario)
        rest = Run()
        Mission(scenario, begun=begun, listeners=[rest]).run()
        yield rest


def _moves(run: Run) -> list[tuple[str, int, int, str]]:
    keys = "robot", "from", "to", "by"
    return [tuple(one[key] for key in keys) for one in run.all("move")]
