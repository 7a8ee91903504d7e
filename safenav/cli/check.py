"""``safenav check``: judge scenarios, traces, bundles and motions, recognized by their content."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile, is_zipfile

import click
from msgspec import Struct, to_builtins

from safenav.cli import options, report_error, warn
from safenav.cli.judgement import JudgedFile
from safenav.errors import Diagnostic, ExitCode, InputError, SafenavError, UsageError
from safenav.file_kind import another_kind, kind_of
from safenav.report.terminal.fold import echo_folded
from safenav.trace.reading import read_bytes, read_content
from safenav.trace.words import counted

if TYPE_CHECKING:
    from safenav.checked_trace import CheckedTrace

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav check lab.yaml --strict
  safenav run lab.yaml --trace lab.jsonl && safenav check lab.jsonl
  safenav certify lab.yaml -o bundle && safenav check bundle
With the extra 'motion':
  safenav export lab.jsonl --motion lab.motion.jsonl
  safenav check lab.jsonl lab.motion.jsonl
\b
Exit codes: (of several files, the largest)
  0  valid and realizable; no rule broken; accepted; each requirement satisfied
  1  unrealizable (--strict: or a warning); a rule broken, or an outcome missing;
     refused; a requirement violated or undecided
  2  bad input or usage   3  time, memory or size limit   4  synthesizer failure
"""

SCENARIO, TRACE, MOTION, BUNDLE = "scenario", "trace", "motion file", "bundle"

READ_BY = {
    "strict": (SCENARIO,),
    "partial": (TRACE,),
    "show_all": (TRACE, MOTION),
    "require": (MOTION,),
    "rate": (MOTION,),
}
"""The kinds of files that each option is for."""

BEGINNING = 5_000_000
"""Bytes of a file from which its kind is recognized."""


class GivenFile(Struct, frozen=True):
    """A file to judge. ``content``: of standard input or a pipe, which can be read only once."""

    path: Path
    kind: str
    content: bytes | None = None

    @property
    def source(self) -> str:
        """Its name in messages."""
        return "<stdin>" if str(self.path) == "-" else str(self.path)

    def bytes(self) -> bytes:
        return read_content(self.path) if self.content is None else self.content


@click.command(epilog=EPILOG)
@click.argument("files", metavar="FILE...", type=options.INPUT, nargs=-1, required=True)
@click.option("--strict", is_flag=True, help="Scenarios: warnings count as unrealizable.")
@click.option("--partial", is_flag=True, help="Traces: accept a missing outcome.")
@click.option("--all", "show_all", is_flag=True, help="Traces, motions: print all broken rules.")
@click.option("--require", metavar="FORMULA", multiple=True, help="Motions: also check this.")
@click.option(
    "--rate",
    type=options.FiniteRange(min=0, min_open=True, max=10_000),
    default=50.0,
    metavar="HZ",
    help="Motions: samples per second for requirements.  [50]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the whole results as JSON.")
def command(
    files: tuple[Path, ...],
    strict: bool,
    partial: bool,
    show_all: bool,
    require: tuple[str, ...],
    rate: float,
    as_json: bool,
) -> int:
    """Judge each FILE: a scenario (are its robots realizable?), a trace (docs/judge.md), a
    bundle (docs/certify.md), or a motion file together with its trace (docs/motion.md). What they
    are is recognized by their content; `-` is standard input."""
    found = [recognized(path) for path in files]
    kinds = {file.kind for file in found}
    refuse_unread(click.get_current_context(), kinds)
    traces = [file for file in found if file.kind == TRACE]
    for file in found:
        if file.kind == MOTION and not traces:
            hint = f"give both: safenav check {file.path} TRACE"
            raise UsageError(f"{file.path}: a motion is judged against its trace\n    {hint}")
    judges: dict[str, Callable[[GivenFile], JudgedFile]] = {
        SCENARIO: lambda file: of_scenario(file, strict),
        TRACE: lambda file: of_trace(file, show_all, partial, MOTION in kinds),
        MOTION: lambda file: of_motion(file, traces, show_all, require, rate),
        BUNDLE: of_bundle,
    }
    status, data = ExitCode.OK, list[Mapping[str, Any]]()
    several = len(found) > 1
    for file in found:
        try:
            judged = judges[file.kind](file)
        except SafenavError as error:
            if not several:
                raise
            judged = JudgedFile(error.exit_code, {"error": str(error)})
            report_error(str(error))
        status = max(status, judged.status)
        data.append({"file": str(file.path), **judged.data} if several else judged.data)
        if not as_json:
            if several and file.kind == SCENARIO and judged.lines:
                click.echo(f"{file.path}:")
            echo_folded(judged.lines)
            for line in judged.warnings:
                echo_folded([line], err=True) if line.startswith(" ") else warn(line)
    if as_json:
        click.echo(json.dumps(data if several else data[0], indent=2))
    return status


def recognized(path: Path) -> GivenFile:
    """Return the kind of a file. Raises InputError for a file that is not judged."""
    name = str(path)
    if path.is_dir():
        if not (path / "manifest.json").is_file():
            hint = f"a bundle has a manifest.json; to run scenarios: safenav batch {path}"
            raise InputError([Diagnostic(name, 0, 0, "this folder is not a bundle", hint)])
        return GivenFile(path, BUNDLE)
    if path.is_file() and is_zipfile(path):
        try:
            with ZipFile(path) as archive:
                names = archive.namelist()
        except Exception:  # a broken archive, which the checker refuses
            return GivenFile(path, BUNDLE)
        if "manifest.json" in names:
            return GivenFile(path, BUNDLE)
        hint = "a bundle has a manifest.json: safenav certify writes one"
        raise InputError([Diagnostic(name, 0, 0, "this archive is not a bundle", hint)])
    content = None
    try:
        if path.is_file():
            with path.open("rb") as stream:
                text = stream.read(BEGINNING).decode("utf-8", "replace")
        elif name == "-" or path.exists():
            content = read_content(path)
            text = content[:BEGINNING].decode("utf-8", "replace")
        else:
            text = ""
    except OSError:  # reported by its reader
        text = ""
    if (kind := kind_of(text)) in (SCENARIO, TRACE, MOTION):
        return GivenFile(path, str(kind), content)
    if wrong := another_kind(text, f"{SCENARIO}, {TRACE}, {BUNDLE} or {MOTION}", name):
        raise InputError([Diagnostic(name, 0, 0, *wrong)])
    lines = path.suffix == ".jsonl" or (name == "-" and text.lstrip().startswith("{"))
    return GivenFile(path, TRACE if lines else SCENARIO, content)


def refuse_unread(context: click.Context, kinds: set[str]) -> None:
    """Raises UsageError for an option that is for none of the given kinds of files."""
    for name in options.given(context) & READ_BY.keys():
        if kinds.isdisjoint(READ_BY[name]):
            option = next(each for each in context.command.params if each.name == name)
            wanted = " and ".join(f"{kind}s" for kind in READ_BY[name])
            raise UsageError(f"{option.opts[0]} is for {wanted}; no such FILE is given")


def of_scenario(file: GivenFile, strict: bool) -> JudgedFile:
    from safenav.cli.check_scenario import judge_scenario
    from safenav.scenario.reading.loader import load_scenario, load_scenario_text

    if file.content is None:
        return judge_scenario(load_scenario(file.path), strict)
    try:
        text = file.content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError([Diagnostic(str(file.path), 0, 0, "not valid UTF-8 text")]) from error
    return judge_scenario(load_scenario_text(text, str(file.path)), strict)


def of_trace(file: GivenFile, show_all: bool, partial: bool, with_motion: bool) -> JudgedFile:
    """Judge a trace. Its requirements are judged on the motion, if that is given."""
    from safenav.checked_trace import checked

    content = file.bytes()
    found = checked(content, file.source)
    lines = [*trace_lines(found, show_all, partial)]
    header = read_bytes(content.partition(b"\n")[0], file.source).header
    if not with_motion and (formulas := header.scenario.requirements):
        what = counted(len(formulas), "requirement")
        lines.append(f"Not judged: {what}; give the motion of the run also.")
    good = not found.findings and (found.complete or partial)
    return JudgedFile(status_of(good), {"ok": not found.findings, **to_builtins(found)}, lines)


def trace_lines(found: CheckedTrace, show_all: bool, partial: bool) -> Iterator[str]:
    yield from broken(found.source, found.findings, show_all)
    yield from broken(found.source, found.notes, show_all, "more not judged")
    if not found.complete:
        yield "The trace ends before its outcome; checked as far as it goes."
        if not partial:
            yield "The outcome is missing. Pass --partial to accept that."
    if not found.findings:
        numbers = found.statistics
        yield (
            f"{found.source}: no rule broken in {counted(numbers['ticks'], 'tick')} of "
            f"{counted(numbers['robots'], 'robot')} ({counted(numbers['moves'], 'move')}, "
            f"{counted(numbers['goals'], 'goal')}, {numbers['resolved']} resolved, "
            f"outcome {found.outcome or 'unknown'})."
        )
    if found.strays or found.hands:
        yield (
            f"{counted(found.strays, 'step')} ended elsewhere than commanded, "
            f"{counted(found.hands, 'change')} by a user or the world."
        )


def of_motion(
    file: GivenFile, traces: Sequence[GivenFile], show_all: bool, more: tuple[str, ...], rate: float
) -> JudgedFile:
    """Judge a motion against its trace (if none of the traces is its own, against the first), then
    the requirements of the scenario and ``more``."""
    from safenav.motion.check.execution import trackings
    from safenav.motion.check.verdict import check_motion
    from safenav.motion.file.reading import parsed
    from safenav.motion.requirements import SATISFIED, MotionRecording, judged, requirements_of

    motion = parsed(file.bytes(), file.source)
    runs = [read_bytes(each.bytes(), each.source) for each in traces]
    run = next((run for run in runs if run.digest == motion.header.trace), runs[0])
    found = check_motion(motion, run)
    formulas = requirements_of(run, more)
    # The signals of a motion that breaks rules are not reliable.
    judgements = [] if found else judged(MotionRecording(motion, run, rate), formulas)
    tracked = [] if found else trackings(motion, run)
    lines = [*broken(file.source, found, show_all)]
    if found and formulas:
        lines.append("the requirements are not evaluated on a motion that breaks rules")
    if not found:
        robots, seconds = counted(len(motion.header.robots), "robot"), motion.outcome.makespan
        lines.append(f"{file.source}: no rule broken in {seconds:.1f} s of {robots}")
    lines += [str(one) for one in (*tracked, *judgements)]
    good = not found and all(one.verdict == SATISFIED for one in judgements)
    data = {"ok": good, "findings": to_builtins(found), "execution": to_builtins(tracked)}
    data["requirements"] = [one.data() for one in judgements]
    return JudgedFile(status_of(good), data, lines)


def of_bundle(file: GivenFile) -> JudgedFile:
    """Check a bundle by the installed checker, not by the copy in the bundle."""
    from safenav.certify.check import Acceptance, check_bundle
    from safenav.report.terminal.table import table

    verdict = check_bundle(file.path)
    claims = [dict(claim) for claim in verdict.claims]
    rows = [(claim["id"], claim["text"]) for claim in claims]
    colour = "green" if verdict.accepted else "red"
    reason = f": {verdict.reason}" if verdict.reason else ""
    lines = [*table(("claim", "established"), rows)] if rows else []
    lines += [f"not compared: {what}" for what in verdict.not_compared]
    lines.append(f"{file.path}: {click.style(verdict.result, fg=colour)}{reason}")
    status = {
        Acceptance.ACCEPTED: ExitCode.OK,
        Acceptance.REFUSED: ExitCode.NEGATIVE,
        Acceptance.TOO_LARGE: ExitCode.RESOURCE_LIMIT,
    }[verdict.result]
    data = {"verdict": verdict.result, "reason": verdict.reason, "claims": claims}
    data["not_compared"] = list(verdict.not_compared)
    return JudgedFile(status, data, lines)


def status_of(good: bool) -> ExitCode:
    return ExitCode.OK if good else ExitCode.NEGATIVE


def broken(
    source: object, found: Sequence[object], show_all: bool, rest: str = "more"
) -> Iterator[str]:
    """Yield the first finding about a source, or all. ``rest``: noun for those left out."""
    yield from (f"{source}: {each}" for each in (found if show_all else found[:1]))
    if len(found) > 1 and not show_all:
        yield f"and {len(found) - 1} {rest} (--all shows them)"
