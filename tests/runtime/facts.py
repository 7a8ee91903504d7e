"""Facts about the run of a case file: the check that each key of its lines ``#:`` stands for."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import pytest
from click.testing import CliRunner
from msgspec import convert
from msgspec.structs import replace

from certify.making import bundle_at, certified, files_of, judged, lines_of, rewrite, with_lines
from once import from_yaml
from runtime.continued import moves, rests
from runtime.played import Line, Run, begin, loaded, whole
from runtime.worlds import Clocked, Distant, Driven, Faulty, Remote, Swinging
from safenav.cli.check import check as command
from safenav.errors import InputError, UsageError
from safenav.report.terminal.story import Story
from safenav.run.checked import check_trace
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Failures
from safenav.trace.records import KINDS
from support.damage import damage, fits, value

Facts = dict[str, Any]
WORLDS: dict[str, Any] = {
    **{"simulated": None, "faulty": Faulty, "driven": Driven},
    **{"remote": Remote, "clocked": Clocked, "distant": Distant, "swinging": Swinging},
}
WRONG = ("slides", "jams", "looks", "faults", "speeds")
CASES = Path(__file__).parent / "cases"


def read_case(file: Path) -> tuple[str, Facts]:
    """Return the scenario and the facts of a case file."""
    lines = file.read_text().splitlines(keepends=True)
    facts = from_yaml("".join(line[3:] for line in lines if line.startswith("#:"))) or {}
    return "".join(line for line in lines if not line.startswith("#:")), facts


def case(name: str) -> str:
    """Return the scenario of a case, ``FOLDER/STEM``."""
    return read_case(CASES / f"{name}.yaml")[0]


def hold(text: str, facts: Facts) -> None:
    """Check the facts about a scenario and its run."""
    facts = dict(facts)
    if "refused" in facts:
        with pytest.raises(InputError) as error:
            loaded(text)
        _has(str(error.value), facts["refused"])
        return
    run = staged(text, facts)
    edits = facts.pop("damaged", ())
    cut = facts.pop("cut", None)
    forged, proven = facts.pop("forged", ()), facts.pop("certified", ())
    if said := facts.pop("notes", ()):
        _has("\n".join(map(str, check_trace(run.lines).notes)), said)
    _printed(text, facts)
    _recorded(run, facts)
    for edit in edits:
        _refused(run, edit)
    if cut:
        _cut(run, text, cut)
    for edit in forged:
        _forged(bundle_at("plan", text), edit)
    if proven:
        _has(certified(text), () if proven is True else proven)


def staged(text: str, facts: Facts) -> Run:
    """Play a run in the world, and with the operator, that the facts name; the audit must accept
    its trace, except where the world lies."""
    waits, lies = facts.pop("waits", None), facts.pop("lies", False)
    about = {key: facts.pop(key) for key in WRONG if key in facts}
    kind = WORLDS[facts.pop("world", None) or ("faulty" if "faults" in about else "simulated")]
    scenario = replace(loaded(text), failures=convert(facts.pop("failures", {}), Failures))
    for was, is_ in facts.pop("there", {}).items():
        assert was in text, was
        text = text.replace(was, is_)
    world = None if kind is None else kind(loaded(text), **about)
    mission, run = begin(scenario, world=world, attended=waits is not None)
    left, says = list(waits or ()), facts.pop("says", {})
    while mission.result is None:
        for line in says.get(mission.tick, ()):
            _intervene(mission, line)
        if waits is not None and mission.waiting is not None and mission.still:
            for line in left.pop(0) if left or not isinstance(world, Clocked) else ():
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


def _has(text: str, words: list[str]) -> None:
    assert all(each in text for each in words), text


def _printed(text: str, facts: Facts) -> None:
    """Check the story of the run, and what ``safenav check`` prints about the scenario."""
    if "story" in facts or "no story" in facts:
        lines, scenario = list[str](), loaded(text)
        story = Story(scenario, lambda line: lines.append(click.unstyle(str(line))), maps=False)
        Mission(scenario, listeners=[story]).run()
        told = "\n".join(lines)
        _has(told, facts.pop("story", ()))
        assert not any(words in told for words in facts.pop("no story", ())), told
    if "check" in facts or "no check" in facts:
        output = CliRunner().invoke(command, ["-"], input=whole(text)).output
        _has(output, facts.pop("check", ()))
        assert not any(words in output for words in facts.pop("no check", ())), output


def _recorded(run: Run, facts: Facts) -> None:
    """Check the lines of the trace."""
    _has(run.outcome["explanation"], facts.pop("explained", ()))
    assert run.still_open == facts.pop("left_open", run.still_open)
    places = [run.records.index(_found(run, *one)) for one in facts.pop("in order", ())]
    assert places == sorted(places), places
    for what, rows in ({"outcome": [{"outcome": "completed"}]} | facts).items():
        some, _, kind = what.rpartition(" ")
        fields = {name.rstrip("_") for name in KINDS[kind].__struct_fields__}
        assert {key.partition(".")[0] for row in rows for key in row} <= fields, what
        for row in rows if some else ():
            count = len(_all(run, kind, row))
            expected = {"some": count > 0, "no": count == 0}
            assert expected[some] if some in expected else count == int(some), (what, row, count)
        if not some:
            found = run.all(kind)
            assert len(found) == len(rows), (what, found)
            for row, line in zip(rows, found, strict=True):
                assert fits(line, row), (row, {key: value(line, key) for key in row})


def _all(run: Run, kind: str, fields: Facts) -> list[Line]:
    return [line for line in run.all(kind) if fits(line, fields)]


def _found(run: Run, kind: str, fields: Facts | None = None, nth: int = 0) -> Line:
    """One of these lines, by default the first."""
    return _all(run, kind, fields or {})[nth]


def _refused(run: Run, edit: Facts) -> None:
    """The audit refuses the damaged trace."""
    damaged = _damaged(run, edit)
    words, rule = edit.get("found", ""), edit.get("rule")
    told, broken = damaged.findings, damaged.broken
    assert told and words in told and (not rule or rule in broken), told


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
    expected = moves(run.records)
    for number, rest in enumerate(rests(loaded(text))):
        assert rest.outcome["outcome"] == run.outcome["outcome"], number
        assert alike != "moves" or moves(rest.records) == expected, number
