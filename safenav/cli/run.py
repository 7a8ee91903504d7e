"""``safenav run`` and ``safenav resume``: run a scenario, or the rest of a run."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec import Struct
from msgspec.structs import replace

from safenav.cli import options, warn
from safenav.cli.run_session import MakeMission, RunSession, attendant, limited
from safenav.errors import ExitCode, UsageError
from safenav.outfile import write_out
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.trace.writing import next_part

if TYPE_CHECKING:
    from safenav.runtime.run.checkpoint import Resumption

RUN_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml
  safenav run lab.yaml -o out                    # out/lab.jsonl and out/lab.html
  safenav run lab.yaml --html lab.html --trace lab.jsonl
  safenav run lab.yaml --motion lab.motion.jsonl # extra 'motion'
  safenav run lab.yaml --live                    # extra 'studio'
  safenav run lab.yaml --clock live              # robots move at the same time
  echo give_up > fixes.txt && safenav run lab.yaml --clock live --operator fixes.txt
\b
Exit codes:
  0  the run ended as the scenario expects (without 'expect': completed)
  1  operator needed, unrealizable, or not as expected
  2  bad input   3  tick, time or memory limit   4  synthesizer failure
  130  interrupted
"""

RESUME_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  head -120 lab.jsonl > part.jsonl               # as if that run had been killed
  safenav resume part.jsonl lab.yaml --trace whole.jsonl
  safenav resume part.jsonl lab.yaml -o out      # out/part-2.jsonl and out/part-2.html
\b
Exit codes: those of 'safenav run', for the resumed run
"""


output = options.output(
    *(".jsonl", ".html"),
    folder=True,
    help="FILE.jsonl (trace), FILE.html (page), or a folder.",
)
motion_file = click.option(
    "--motion", type=options.LINES, help="Write the run in metres and seconds."
)


class Outputs(Struct, frozen=True):
    """The files that a run writes."""

    trace: Path | None = None
    html: Path | None = None
    motion: Path | None = None

    @classmethod
    def of(
        cls,
        output: Path | None,
        stem: str,
        trace: Path | None,
        html: Path | None,
        motion: Path | None,
    ) -> Outputs:
        """Return the files of all options. ``stem``: name of the files in ``output``, if that is a
        folder."""
        if output is not None:
            trace, html = _by_its_ending(output, stem, trace, html)
            if motion is not None and motion.resolve() in [
                p and p.resolve() for p in (trace, html)
            ]:
                raise UsageError(f"--motion {motion} would overwrite --output; give another file")
        return cls(trace, html, motion)

    def temporary(self, stem: str) -> str | None:
        """Return the name of a temporary trace, if the page or the motion must be made from a
        trace."""
        return f"{stem}.jsonl" if self.html is not None or self.motion is not None else None

    def write(self, trace: Path | None) -> list[str]:
        """Write page and motion; return a message for each requirement that is not satisfied."""
        _write_page(trace, self.html)
        return [] if self.motion is None or trace is None else _write_motion(trace, self.motion)


@click.command(epilog=RUN_EPILOG)
@click.argument("scenario", type=options.INPUT)
@output
@options.trace
@options.html
@motion_file
@options.result_as_json
@options.seed
@options.max_ticks
@options.time_limit
@click.option(
    "--clock",
    type=click.Choice(["live", "lockstep"]),
    help="In seconds (live) or ticks (lockstep).",
)
@click.option("--lockstep", is_flag=True, help="Short for --clock lockstep.")
@options.operator
@options.verify
@options.live
@click.option(
    "--map/--no-map",
    "maps",
    default=True,
    help="Draw the map at the main events.",
)
def command(
    scenario: Path,
    output: Path | None,
    trace: Path | None,
    html: Path | None,
    motion: Path | None,
    as_json: bool,
    seed: int | None,
    max_ticks: int | None,
    time_limit: float | None,
    clock: str | None,
    lockstep: bool,
    operator: str | None,
    verify: bool,
    live: bool,
    maps: bool,
) -> int:
    """Run SCENARIO: synthesize a controller for each robot, then execute them in a world
    with the scenario's hidden obstacles until every robot has met its objective."""
    if lockstep and clock == "live":
        raise UsageError("--clock live and --lockstep contradict each other: give one of them")
    clock = "lockstep" if lockstep else clock
    if live:
        from safenav.studio.starting import start_live

        _refuse_beside_live(click.get_current_context())
        start_live(scenario, seed=seed, trace=trace, clock=clock)
        return ExitCode.OK
    plan = load_scenario(scenario)
    for note in plan.map.notes:
        warn(note)
    if seed is not None:
        plan = replace(plan, seed=seed)
    plan = limited(plan, max_ticks, time_limit)
    if clock is not None:
        plan = replace(plan, clock=Clock(clock))
    files = Outputs.of(output, scenario.stem, trace, html, motion)
    _check_movable(plan, motion)
    operator = attendant(operator, plan.clock is Clock.LIVE, as_json)

    with ExitStack() as stack:
        needed = files.temporary(scenario.stem)
        make = _simulated(verify, attended=operator is not None)
        run = RunSession(make, stack, files.trace, temporary=needed, as_json=as_json, maps=maps)
        run.begin(plan)
        run.run(operator)
        unmet = files.write(run.trace)
    return run.report(scenario, files.html, unmet)


def _refuse_beside_live(context: click.Context) -> None:
    """Raises UsageError for options that a run in the browser does not read."""
    unread = options.given(context) - {
        "scenario",
        "live",
        "trace",
        "seed",
        "clock",
        "lockstep",
        "maps",
    }
    for option in context.command.params:
        if option.name in unread:
            off = context.params[option.name] is False
            name = max(option.secondary_opts if off else option.opts, key=len)
            raise UsageError(
                f"{name} has no effect with --live\n"
                "    control and save the run on its page; --trace writes its trace as it happens"
            )


def _simulated(verify: bool, *, attended: bool, begun: Resumption | None = None) -> MakeMission:
    """Return a function that makes missions in the scenario's own world. ``begun``: the run that
    they continue."""
    return lambda plan, listeners: Mission(
        plan,
        default_synthesizer(plan, verify=verify),
        listeners=listeners,
        progress=WaitingLine(),
        attended=attended,
        begun=begun,
        checkpoints=True,
    )


def _check_movable(plan: Scenario, motion: Path | None) -> None:
    if motion is not None:
        from safenav.motion.making import check_movable

        check_movable(plan)


def _write_page(trace: Path | None, html: Path | None) -> None:
    if html is not None and trace is not None:
        from safenav.report.page.html import page_of_trace
        from safenav.trace.reading import read_trace

        write_out(html, page_of_trace(read_trace(trace), trace.name))


def _by_its_ending(
    output: Path, stem: str, trace: Path | None, html: Path | None
) -> tuple[Path | None, Path | None]:
    """Return the files of trace and page, where ``output`` sets one or both. Raises UsageError if
    another option also sets it."""
    writes_trace, writes_page = output.suffix != ".html", output.suffix != ".jsonl"
    for option, given in (("--trace", writes_trace and trace), ("--html", writes_page and html)):
        if given:
            raise UsageError(
                f"--output {output} and {option} {given} name the same output; give one"
            )
    if not writes_page:
        return output, html
    if not writes_trace:
        return trace, output
    file = options.made_folder(output) / (stem if stem != "-" else "scenario")
    return file.with_name(f"{file.name}.jsonl"), file.with_name(f"{file.name}.html")


def _write_motion(trace: Path, motion: Path) -> list[str]:
    """Write the motion of a run; return a message for each requirement that is not satisfied."""
    from safenav.motion.file.reading import text_of
    from safenav.motion.making import motion_of
    from safenav.motion.requirements import MotionRecording, judged, requirements_of
    from safenav.trace.reading import read_trace

    read = read_trace(trace)
    made = motion_of(read)
    write_out(motion, text_of(made))
    found = judged(MotionRecording(made, read), requirements_of(read))
    return [one.complaint for one in found if one.complaint]


@click.command(epilog=RESUME_EPILOG)
@click.argument("trace", type=options.INPUT)
@click.argument("scenario", type=options.INPUT)
@output
@click.option("--trace", "own", type=options.LINES, help="Write the trace of the resumed run.")
@options.html
@motion_file
@options.result_as_json
@options.seed
@options.max_ticks
@options.time_limit
@options.operator
@options.verify
@click.option("--map/--no-map", "maps", default=True, help="Draw the map at the main events.")
@click.option("--clock", "--lockstep", "--live", "clock", is_flag=True, hidden=True)
def resume(
    trace: Path,
    scenario: Path,
    output: Path | None,
    own: Path | None,
    html: Path | None,
    motion: Path | None,
    as_json: bool,
    seed: int | None,
    max_ticks: int | None,
    time_limit: float | None,
    operator: str | None,
    verify: bool,
    maps: bool,
    clock: bool,
) -> int:
    """Continue the run of TRACE, whose scenario is SCENARIO, from its last checkpoint. Strategies
    are synthesized again where the robots are. The trace of the resumed run begins with the lines
    before that checkpoint, so it is the trace of one run."""
    from safenav.runtime.run.checkpoint import resumption
    from safenav.trace.reading import read_trace

    if clock:
        raise UsageError("a resumed run has the clock of its trace, and no live page; see --html")
    files = Outputs.of(output, next_part(trace).stem, own, html, motion)
    before = read_trace(trace)
    if before.header.scenario.world == "external":
        raise UsageError(f"{trace}: real robots have run it; safenav drive --resume continues it")
    plan = load_scenario(scenario)
    live = Clock.LIVE if before.header.clock is not None else Clock.LOCKSTEP
    plan = limited(replace(plan, clock=live), max_ticks, time_limit)
    plan = plan if seed is None else replace(plan, seed=seed)
    begun = resumption(before, plan)
    _check_movable(plan, motion)
    if operator is not None and plan.clock is not Clock.LIVE:
        raise UsageError("--operator helps live runs only")
    operator = attendant(operator, plan.clock is Clock.LIVE, as_json)

    with ExitStack() as stack:
        needed = files.temporary(trace.stem)
        make = _simulated(verify, attended=operator is not None, begun=begun)
        run = RunSession(make, stack, files.trace, temporary=needed, as_json=as_json, maps=maps)
        run.begin(plan)
        run.run(operator)
        unmet = files.write(run.trace)
    return run.report(None, files.html, unmet)
