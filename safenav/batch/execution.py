"""Execution of a case in this process. A failed case never raises an exception."""

from __future__ import annotations

import hashlib
import re
import traceback
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import yaml
from msgspec.structs import replace

from safenav import errors
from safenav.batch.case import Case, CaseVerdict, Conditions, Ledger, Result, differences, file_name
from safenav.batch.matrix import varied
from safenav.errors import Outcome, needing
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text, scenario_text
from safenav.scenario.yaml.document import plain
from safenav.scenario.yaml.findings import Findings, root_of
from safenav.synthesis.program import find_binary
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.file import TraceWriter, read_trace

if TYPE_CHECKING:
    from safenav.motion.check.requirements import Judgement


def execute(case: Case, conditions: Conditions, trace: Path) -> Result:
    """Run a case and write its trace. Return its result."""
    try:
        return _run(case, load(case), conditions, trace)
    except errors.InputError as error:
        return case.result(CaseVerdict.INVALID, [_line(d) for d in error.diagnostics])
    except errors.ResourceLimitError as error:
        return case.result(CaseVerdict.LIMIT, [str(error)])
    except errors.SafenavError as error:
        return case.result(CaseVerdict.ERROR, [str(error)])
    except Exception as error:
        reason = f"internal error: {type(error).__name__}: {error}"
        return case.result(CaseVerdict.ERROR, [reason], traceback.format_exc())


def load(case: Case) -> Scenario:
    """Return the scenario of a case with its settings applied. Raises InputError."""
    text = scenario_text(Path(case.file)) if case.text is None else case.text
    return load_scenario_text(text, case.file, lambda root, found: varied(root, case, found))


def _run(case: Case, scenario: Scenario, conditions: Conditions, trace: Path) -> Result:
    ledger = Ledger()
    # A batch runs cases in parallel, so each runs one synthesis at a time.
    synthesizer = default_synthesizer(scenario, binary=_binary(), at_once=1)
    with TraceWriter(trace) as writer:
        Mission(scenario, synthesizer, listeners=[ledger, writer]).run()
    requirements = _required(trace) if scenario.requirements else []
    folder = conditions.certify
    uncertified = [] if folder is None else _certify(case, trace, synthesizer, Path(folder))
    expect = scenario.expect
    if expect.outcome is None:
        expect = replace(expect, outcome=Outcome.COMPLETED)
    wrong = [*differences(expect, ledger, scenario.map.word), *uncertified]
    wrong += [complaint for one in requirements if (complaint := one.complaint)]
    verdicts = {each.name: each.data() for each in requirements} or None
    verdict = CaseVerdict.DIFFERENT if wrong else CaseVerdict.PASSED
    found = ledger.measured(scenario.name) | {"requirements": verdicts}
    return replace(case.result(verdict, wrong), **found)


def _required(trace: Path) -> list[Judgement]:
    """Return the verdicts on a run's requirements, on the motion computed from its trace."""
    with needing("'requirements' of a scenario", "motion"):
        from safenav.motion.check.requirements import judged
        from safenav.motion.making import motion_of
    run = read_trace(trace)
    return judged(motion_of(run), run)


def _certify(case: Case, trace: Path, synthesizer: Synthesizer, folder: Path) -> list[str]:
    """Write a run's bundle. Return a message if that fails or its checker refuses it."""
    from safenav.certify.bundle import make_bundle
    from safenav.certify.check import sources_of

    stem = case.name.replace("/", "+")
    if not re.fullmatch(r"[A-Za-z0-9._=+-]{1,100}", stem):
        stem = file_name(case.name, hashlib.sha256(case.name.encode()).hexdigest())
    target = folder / f"{stem}.zip"
    target.unlink(missing_ok=True)
    data = trace.read_bytes()
    try:
        sources = sources_of(Path(case.file), _text_as_run(case))
        make_bundle(target, data, sources, synthesizer)
    except (errors.NotCertifiedError, errors.ResourceLimitError, errors.UsageError) as error:
        return [f"not certified: {error}"]
    return []


def _text_as_run(case: Case) -> str:
    """Return the text of a case's scenario with its settings applied."""
    text = case.text or ""
    if not case.settings or (root := root_of(text)) is None:
        return text
    data = plain(varied(root, case, Findings(case.file)))
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True)


_binary = cache(find_binary)
"""The synthesizer, found once per process, since a search can take as long as a synthesis."""


def _line(diagnostic: errors.Diagnostic) -> str:
    """Return the text of a diagnostic on one line."""
    return "; ".join(part.strip() for part in str(diagnostic._replace(source="")).splitlines())
