"""Bundle writing: the files of a run with their evidence (layout: docs/bundle.md)."""

import hashlib
import json
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from msgspec import Struct

import safenav
import safenav.judge
from safenav import strict_json
from safenav.certify.check import check_bundle, page_of, sources_of
from safenav.errors import NotCertifiedError, ResourceLimitError, UsageError, Verdict
from safenav.files import json_line
from safenav.judge.bundle.check import VERSION, Judged
from safenav.judge.bundle.evidence import proof_file
from safenav.judge.bundle.strategies import Met, RefusedError, Task
from safenav.judge.engine import judge
from safenav.judge.lines import Line, NotATraceError
from safenav.judge.rules import Rule
from safenav.judge.state import State
from safenav.judge.world import TooLargeError
from safenav.runtime.run.mission import Mission, default_synthesizer, uninterrupted
from safenav.scenario.model import Coordination, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.specification import read_specification
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.file import TraceWriter, read_bytes
from safenav.verify.automaton import Measure, NoMeasureError, measure
from safenav.verify.verification import first_failure


class Made(Struct, frozen=True):
    """A written bundle and its checker's verdict on it."""

    path: Path
    verdict: Judged
    files: int
    bytes: int


def make_bundle(
    target: str | Path, trace: bytes, sources: Mapping[str, bytes], synthesizer: Synthesizer
) -> Made:
    """Write the bundle of a run to ``target``, a folder or a name that ends in .zip.

    ``sources``: the scenario's YAML, map and catalogue files by name. ``synthesizer``: one whose
    cache has the strategies.

    Raises UsageError if the target exists, goals are assigned at run time, a strategy is missing,
    or the disk is full; NotCertifiedError if a checker refuses the bundle; ResourceLimitError if a
    strategy is too large for the checker."""
    target = Path(target)
    if target.exists():
        raise UsageError(f"{target} already exists; choose another name")
    read = read_bytes(trace)
    _certifiable(read.header.scenario)
    with _beside(target) as directory:
        folder = directory / "bundle"
        files = files_of_run(trace, sources, synthesizer)
        write_files(folder, files)
        verdict = check_bundle(folder)
        if verdict.verdict == "too large":
            raise ResourceLimitError(f"no bundle: {verdict.reason}")
        if not verdict.accepted:
            raise NotCertifiedError(f"the checker refuses this run: {verdict.reason}")
        files["index.html"] = page_of(read, verdict).encode()
        write_files(folder, files)
        if target.suffix == ".zip":
            _pack(folder, directory / "bundle.zip")
            (directory / "bundle.zip").replace(target)
        else:
            shutil.move(folder, target)
    return Made(target, verdict, len(files) + 1, sum(map(len, files.values())))


@contextmanager
def _beside(target: Path) -> Iterator[Path]:
    """Yield a temporary folder beside the target. Report a failed write into it as a failure to
    write the target."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".bundle-") as folder:
            yield Path(folder)
    except OSError as error:
        raise UsageError(f"cannot write {target}: {error.strerror}") from error


def _certifiable(scenario: Scenario) -> None:
    """Raise UsageError for a scenario whose runs cannot be certified."""
    if scenario.coordination is Coordination.ASSIGNABLE:
        raise UsageError(
            "runs with 'coordination: assignable' are not certified\n"
            "    use 'coordination: resynthesis'"
        )


def files_of_run(
    trace: bytes, sources: Mapping[str, bytes], synthesizer: Synthesizer
) -> dict[str, bytes]:
    """Return all files of a bundle except the page and the manifest. Repeated syntheses take their
    strategies from the cache. Raises UsageError, which names the missing part, if that fails."""

    def automata(e: Line) -> Iterator[bytes]:
        text = synthesizer.cache.load_text(e.spec)
        about = f"of {e.robot} at tick {e.tick} ({(e.strategy or e.spec)[:12]})"
        again = "run the scenario again with `safenav certify`"
        gone = UsageError(f"the strategy {about} is no longer in the cache; {again}")
        if text is None:
            raise gone
        spec = read_specification(text, robot=e.robot)
        if e.verdict == "unrealizable":
            result = synthesizer.counterstrategy(spec)
            if result.strategy_json is not None and result.verdict is Verdict.UNREALIZABLE:
                yield result.strategy_json
            return
        data = synthesizer.synthesize(spec).strategy_json
        if data is None or hashlib.sha256(data).hexdigest() != e.strategy:
            raise gone
        yield data

    return {
        "trace.jsonl": trace,
        **{f"source/{name}": data for name, data in sources.items()},
        **proofs_of(trace, automata),
        **programs(),
    }


def programs() -> dict[str, bytes]:
    """Return the files of the checker in a bundle: ``check.py`` and the folder ``judge``."""
    judge = Path(safenav.judge.__file__).parent
    found = {f"judge/{path.relative_to(judge).as_posix()}": path for path in judge.rglob("*.py")}
    found["check.py"] = found.pop("judge/bundle/check.py")
    own = {"safenav.judge": "judge"}
    found["judge/strict_json.py"] = Path(str(strict_json.__file__))
    own["safenav.strict_json"] = "judge.strict_json"
    texts = {name: found[name].read_text() for name in sorted(found)}
    for before, after in own.items():
        texts = {name: text.replace(before, after) for name, text in texts.items()}
    return {name: text.encode() for name, text in texts.items()}


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files and their manifest."""
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    manifest = {
        "format": "safenav-bundle",
        "version": VERSION,
        "files": {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for name, data in sorted(files.items())
        },
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def _pack(folder: Path, archive: Path) -> None:
    """Write a .zip whose bytes depend only on the files."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            name = zipfile.ZipInfo(path.relative_to(folder).as_posix(), (1980, 1, 1, 0, 0, 0))
            name.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(name, path.read_bytes())


Automata = Callable[[Line], Iterable[bytes]]
"""A function that yields the automata of a ``synthesis`` line, the best one first."""


def proofs_of(trace: bytes, automata: Automata) -> dict[str, bytes]:
    """Return the proofs of all ``synthesis`` lines of a trace, and their strategies, as files.

    A line without a proof gets no file, or a measure that does not decrease: the checker reports
    the reason. Raises ResourceLimitError if a strategy is too large for the checker,
    NotCertifiedError if the data are not a trace."""
    found: dict[str, bytes] = {}

    def prove(e: Line, s: State) -> Iterator[str]:
        name, drives = proof_file(e), e.verdict == "realizable" and e.node is not None
        refutes = e.verdict == "unrealizable" and not e.forbidden
        wanted = refutes or (drives and not s.is_planned(e.robot))
        for data in automata(e) if wanted and name not in found else ():
            if drives:
                found[f"strategies/{e.strategy}.json"] = data
            # On an error, try the next automaton: this one contradicts the line or does not win.
            with suppress(RefusedError, NoMeasureError, LookupError):
                proof = (strategy_proof if drives else counter_proof)(json.loads(data), e, s)
                found[name] = json_line(proof).encode()
                break
        return iter(())

    try:
        judge(trace.splitlines(keepends=True), [Rule("proofs", ("synthesis",), prove, "")])
    except TooLargeError as error:
        raise ResourceLimitError(f"no bundle: {error}") from error
    except NotATraceError as error:
        raise NotCertifiedError(str(error)) from error
    return found


def strategy_proof(automaton: Any, e: Line, s: State) -> dict[str, Any]:
    """Return the measures of a strategy."""
    task = Task(automaton, e, s)
    return {"measures": _measures(task, task.graph.reach([e.node]))}


def counter_proof(automaton: Any, e: Line, s: State) -> dict[str, Any]:
    """Return a counterstrategy with the parts that the synthesizer omits: the environment's initial
    input and choices, and the measures that prove its win.

    Raises NoMeasureError if it does not win; LookupError if the robot has a reply to each input."""
    task = Task(automaton, e, s)
    nodes = task.graph.reach(task.answered(task.opening))
    chosen: list[Any] = [None] * task.graph.count
    for node in nodes:
        targets = task.graph.next[node]
        here = task.poses[node], task.graph.inputs[node]
        unanswered = (row for row in sorted(task.expected(*here)) if not task.replies(node, row))
        chosen[node] = task.graph.inputs[targets[0]] if targets else next(unanswered, None)
        if chosen[node] is None:
            raise LookupError("the robot has a successor for each input")
    measures = _measures(task, nodes, counter=True)
    about = {"start": task.opening, "chosen": [row or () for row in chosen]}
    return {"automaton": automaton, **about, "measures": measures}


def _measures(task: Task, nodes: Sequence[int], *, counter: bool = False) -> list[Measure]:
    """Return the measures on the edges of ``nodes``. A goal without a measure gets a constant in a
    strategy and raises NoMeasureError in a ``counter``strategy."""
    graph = task.graph
    edges = graph.edges(nodes)
    goals, assumed = task.met(edges)
    wanted: list[tuple[Met, list[Met]]] = [(met, assumed) for met in goals]
    if counter:
        wanted = [*((met, []) for met in assumed), ([False] * len(edges[0]), goals)]
    found = list[Measure]()
    for met, excuses in wanted:
        try:
            found.append(measure(graph.count, edges, met, excuses))
        except NoMeasureError:
            if counter:
                raise
            found.append({"n": [0] * graph.count, "a": [None] * graph.count})
    return found


def bundle_of_run(text: str, scenario: Path, target: Path) -> Made:
    """Run a scenario and write its bundle. ``text``: the text of its file.

    Raises UsageError for bad input, NotCertifiedError if a checker refuses the run.
    """
    plan = load_scenario_text(text, str(scenario))
    _certifiable(plan)
    with tempfile.TemporaryDirectory() as directory:
        synthesizer = default_synthesizer(plan)
        trace = Path(directory) / "trace.jsonl"
        with TraceWriter(trace) as writer:
            uninterrupted(Mission(plan, synthesizer, listeners=[writer]).run())
        data = trace.read_bytes()
        sources = sources_of(scenario, text)
        return make_bundle(target, data, sources, synthesizer)


def bundle_of_trace(trace: bytes, source: str, target: Path) -> Made:
    """Write the bundle of an earlier run from its trace and the cache. ``source``: the trace's name
    in messages.

    Raises InputError if it is not a trace, UsageError if a part is missing, and NotCertifiedError
    if the run is refused.
    """
    read_bytes(trace, source)
    return make_bundle(target, trace, {}, Synthesizer(verifier=first_failure))
