"""Pages of the documentation site besides the files of ``docs/``: a hook of mkdocs.

The home page is the README, the command line comes from the commands themselves, and the pages
of the library come from its docstrings. Files outside ``docs/`` are named, not linked: the site
does not have them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click
from mkdocs.structure.files import File, Files

import safenav
from safenav.cli import COMMANDS, HELP
from safenav.cli.options import command_of

ROOT = Path(__file__).resolve().parents[1]
_BESIDE = ("slugs/", "benchmarks/", "proof/", "CHANGELOG", "CITATION", "CONTRIBUTING", "LICENSE")
"""Files outside of ``docs/`` to which the README links."""
_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?!https?:|#)((?:\.\./)+[^)]+)\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made."""
    made = {"index.md": _home(), "cli.md": _commands(), "api.md": _library()}
    for name, text in made.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Name what lies outside of the site instead of linking to it."""
    return _OUTSIDE.sub(lambda found: f"{found[1]} (`{found[2].replace('../', '')}`)", markdown)


def _home() -> str:
    """The README as seen from ``docs/``."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    inside = re.sub(r"\]\(docs/", "](", text)
    return re.sub(rf"\]\((?!https?:|#)(?={'|'.join(_BESIDE)})", "](../", inside)


def _commands() -> str:
    """The help of every command."""
    parts = ["# The command line", "", "```text", HELP + "```"]
    for name in COMMANDS:
        parts += ["", f"## safenav {name}", "", "```text"]
        parts += [_help(command_of(name), f"safenav {name}"), "```"]
    return "\n".join(parts) + "\n"


def _help(command: click.Command, name: str) -> str:
    context = click.Context(command, info_name=name, terminal_width=98, max_content_width=98)
    return command.get_help(context)


def _library() -> str:
    """Everything that ``import safenav`` gives."""
    names = [name for name in safenav.__all__ if not name.startswith("_")]
    homes = {name: getattr(safenav, name).__module__ for name in names}
    return "# The library's names\n\n" + "\n".join(
        f"::: {homes[name]}.{name}\n" for name in sorted(names)
    )
