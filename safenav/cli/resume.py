"""``safenav resume``: continue a run that was interrupted or killed."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click

from safenav.cli import options
from safenav.cli.output import FILE
from safenav.cli.status import exit_code_of
from safenav.errors import UsageError

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --clock live --trace lab.jsonl
  head -20 lab.jsonl > part.jsonl && safenav resume part.jsonl --trace rest.jsonl
  safenav resume part.jsonl --add "eye: {model: bebop2, start: 20, objective: {hold: 20}}"
  echo give_up > fixes.txt && safenav resume part.jsonl lab.yaml --operator fixes.txt
\b
Exit codes: those of 'safenav run', for the rest of the run
"""


@click.command(epilog=EPILOG)
@click.argument("trace", type=click.Path(path_type=Path))
@click.argument("scenario", type=click.Path(path_type=Path), required=False)
@click.option("--trace", "output", type=FILE, help="Write the trace of the rest (JSON Lines).")
@options.operator
@click.option(
    "--add",
    metavar="ROBOT",
    multiple=True,
    help="A robot that joins the team: 'NAME: {model: ..., start: ..., objective: ...}'.",
)
@click.option("--map/--no-map", "maps", default=True, help="Draw the map at the main events.")
def command(
    trace: Path,
    scenario: Path | None,
    output: Path | None,
    operator: str | None,
    add: tuple[str, ...],
    maps: bool,
) -> int:
    """Continue the run of TRACE: each robot from where the trace leaves it, with the target whose
    turn it was, without the resolved obstacles. The rest is a run with its own trace. SCENARIO:
    the file of the run, needed for batteries, inputs, deadlines or beliefs, which the trace does
    not contain."""
    from safenav.cli.operator import run_with_operator
    from safenav.report.terminal.story import Story
    from safenav.report.terminal.synthesis_progress import WaitingLine
    from safenav.runtime.analysis.resuming import resumed
    from safenav.runtime.mission import Mission, default_synthesizer
    from safenav.scenario.reading.joining import joined
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.settings import Clock
    from safenav.trace.reading import read_trace
    from safenav.trace.writing import Listener, TraceWriter

    if output is not None and output.resolve() == trace.resolve():
        raise UsageError(f"--trace {output} would overwrite the trace; give another file")
    read = read_trace(trace)
    plan = resumed(read, None if scenario is None else load_scenario(scenario))
    for robot in add:
        plan = joined(plan, robot)
    if operator is not None and plan.clock is not Clock.LIVE:
        raise UsageError("--operator helps live runs only")
    listeners: list[Listener] = [Story(plan, maps=maps)]
    with ExitStack() as stack:
        if output is not None:
            listeners.append(stack.enter_context(TraceWriter(output)))
        mission = Mission(
            plan,
            default_synthesizer(plan),
            listeners=listeners,
            progress=WaitingLine(),
            attended=operator is not None,
        )
        if operator is not None:
            run_with_operator(mission, operator, helping=True)
        result = mission.result or mission.run()
    return exit_code_of(result.outcome)
