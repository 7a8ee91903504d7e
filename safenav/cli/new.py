"""``safenav new``, ``doctor`` and ``studio``: begin, examine the installation, draw."""

from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Annotated

import click
from msgspec import to_builtins

from safenav.cli import options, warn_of
from safenav.errors import ExitCode, UsageError
from safenav.files import write_out
from safenav.scenario.beginning import DEFAULT, TEMPLATES, scenario_on, template_text
from safenav.scenario.reading.map import load_map, map_keys

SCHEMAS = ("scenario", "trace", "fleet")

_NAMES = "\n".join(f"  {name:8} {text}" for name, text in TEMPLATES.items())
NEW_EXAMPLES = f"""\
  safenav new lab.yaml && safenav run lab.yaml
  safenav new - --template minimal
  safenav new safenav.schema.json --schema
  safenav new --catalogue
With your own map (image, ROS, MovingAI; extra 'maps'):
  safenav new office.yaml --map office_map.yaml --side 0.5
  safenav new floor.yaml --map floor.png --rows 20 --cols 30
\b
Templates:
{_NAMES}
"""


@options.command(NEW_EXAMPLES, "written")
def new(
    file: options.InputOption,
    template: Annotated[
        str | None, click.Choice([*TEMPLATES]), "--template NAME", f"Default: {DEFAULT}."
    ],
    map_file: Annotated[options.InputOption, "--map FILE", "Use this map."],
    rows: options.Rows,
    cols: options.Cols,
    side: options.Side,
    share: options.Share,
    schema: Annotated[
        str | None,
        click.Choice(SCHEMAS),
        "--schema [KIND]",
        "JSON Schema of a scenario, trace or fleet.",
        {"flag_value": SCHEMAS[0], "is_flag": False},
    ],
    catalogue: Annotated[bool, "List the built-in models and obstacle types."],
    force: Annotated[bool, "Replace FILE if it exists."],
) -> int:
    """Write a commented scenario to FILE (default: scenario.yaml; -: standard output), which runs
    unchanged; or what an option names."""
    wanted = [template, map_file, schema, catalogue or None]
    if len(wanted) - wanted.count(None) > 1:
        raise UsageError("give only one of --template, --map, --schema and --catalogue")
    division = {"rows": rows, "cols": cols, "resolution": side, "share": share}
    if map_file is None:
        options.refuse("--map", "rows", "cols", "side", "share")
    if schema is not None or catalogue:
        write_out(file or Path("-"), _reference(schema), replace=force)
        return ExitCode.OK
    file, template = file or Path("scenario.yaml"), template or DEFAULT
    text, about = template_text(template), TEMPLATES[template]
    if map_file is not None:
        text, about = _on_map(map_file, file, division), f"two robots on {map_file}"
    name = quote(str(file))
    steps = [f"draw it:    safenav draw {name}", f"run it:     safenav run {name}"]
    place = file.parent / "safenav.schema.json"
    if not place.exists():
        steps.append(f"in editors: safenav new {quote(str(place))} --schema")
    write_out(file, text, echo=False, replace=force)
    if str(file) != "-":
        click.echo("\n    ".join([f"{file}: {about}", *steps]), err=True)
    return ExitCode.OK


def _reference(of: str | None) -> str:
    """Return the JSON Schema of a kind of files; None: the built-in catalogue."""
    if of is None:
        from safenav.scenario.reading.catalogue import FILES

        return "\n".join(file.read_text(encoding="utf-8") for file in FILES)
    if of == "trace":
        from safenav.trace import schema

        return schema.schema_text()
    from safenav.scenario.language import ScenarioKeys
    from safenav.scenario.yaml.keys import schema_text

    if of == "fleet":
        from safenav.fleet.file import FleetKeys

        return schema_text(FleetKeys)
    return schema_text(ScenarioKeys)


def _on_map(map_file: Path, file: Path, division: Mapping[str, float | None]) -> str:
    world = load_map(map_file, division)
    warn_of(world.notes)
    folder = Path() if str(file) == "-" else file.parent
    text = scenario_on(world, map_keys(map_file, division, folder), map_file.stem)
    if text is None:
        raise UsageError(
            f"{map_file}: fewer than four free regions are connected\n"
            "    try more regions, or --share 0.3: a region is then free if at most 30% is blocked"
        )
    return text


DOCTOR_EXAMPLES = """\
  safenav doctor
  safenav doctor --json
  SAFENAV_CACHE=off safenav doctor
"""


@options.command(DOCTOR_EXAMPLES, "scenarios can be run")
def doctor(as_json: options.AsJson) -> int:
    """List versions, extras and cache, and test the synthesizer. Exit code 4: scenarios cannot be
    run."""
    from safenav.doctor import examine

    found = [*examine()]
    usable = all(finding.good is not False for finding in found)
    marks = {True: ("ok", "green"), False: ("wrong", "red"), None: ("note", "yellow")}
    if as_json:
        data = {"usable": usable, "findings": to_builtins(found)}
        options.print_json(data)
    for finding in () if as_json else found:
        mark, colour = marks[finding.good]
        line = f"{click.style(mark.ljust(6), fg=colour)} {finding.subject:<12} {finding.text}"
        click.echo(line)
    return ExitCode.OK if usable else ExitCode.INTERNAL


STUDIO_EXAMPLES = """\
  safenav studio
  safenav new lab.yaml && safenav studio lab.yaml
  safenav studio lab.yaml --folder . --no-browser
The page is served to this machine only, at an address with a token. Ctrl-C ends the studio.
"""


@options.command(STUDIO_EXAMPLES, "ended")
def studio(
    file: Annotated[Path | None, click.Path(path_type=Path)],
    folder: Annotated[
        Path | None,
        click.Path(path_type=Path, file_okay=False, exists=True),
        "Folder for scenarios and the maps and catalogues that they read; else that of FILE, "
        "or the current one.",
    ],
    port: Annotated[int | None, click.IntRange(1, 65535), "Listen on this port."],
    no_browser: Annotated[bool, "Do not open the page in a browser."],
) -> int:
    """Draw a scenario in a browser, run it, and change its world during the run: close a door,
    assign an objective. FILE is opened, or created on the first save; a folder lists its
    scenarios.
    """
    if str(file) == "-":
        raise UsageError("the studio needs a file: standard input can be read only once")
    from safenav.studio.editor import Editor
    from safenav.studio.server import serve

    serve(Editor.of_file(file, folder), port, browser=not no_browser)
    return ExitCode.OK
