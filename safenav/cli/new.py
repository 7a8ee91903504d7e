"""``safenav new``, ``doctor``, ``studio``: new files, checks of the installation, drawing."""

from pathlib import Path
from shlex import quote
from typing import Annotated

import click
from msgspec import to_builtins

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.files import write_out
from safenav.scenario.beginning import DEFAULT, TEMPLATES, template_text

SCHEMAS = ("scenario", "trace", "fleet")

_NAMES = "\n".join(f"  {name:8} {text}" for name, text in TEMPLATES.items())
NEW_EXAMPLES = f"""\
  safenav new lab.yaml && safenav run lab.yaml
  safenav new - --template minimal
  safenav new safenav.schema.json --schema
  safenav new --catalogue
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
    """Write a commented, runnable scenario, a JSON Schema or the catalogue to FILE. By default,
    FILE is scenario.yaml for a scenario, and otherwise - (standard output)."""
    wanted = [template, schema, catalogue or None]
    if len(wanted) - wanted.count(None) > 1:
        raise UsageError("give only one of --template, --schema and --catalogue")
    if schema is not None or catalogue:
        write_out(file or Path("-"), _reference(schema), replace=force)
        return ExitCode.OK
    file, template = file or Path("scenario.yaml"), template or DEFAULT
    name = quote(str(file))
    steps = [f"draw it:    safenav draw {name}", f"run it:     safenav run {name}"]
    place = file.parent / "safenav.schema.json"
    if not place.exists():
        steps.append(f"in editors: safenav new {quote(str(place))} --schema")
    write_out(file, template_text(template), echo=False, replace=force)
    if str(file) != "-":
        click.echo("\n    ".join([f"{file}: {TEMPLATES[template]}", *steps]), err=True)
    return ExitCode.OK


def _reference(of: str | None) -> str:
    """Return the JSON Schema of a kind of files (None: the built-in catalogue)."""
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
        "Folder of scenarios, maps and catalogues. Default: that of FILE, or the current one.",
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
