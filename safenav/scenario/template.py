"""Template scenarios: commented, and ready to run as they are."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from safenav.errors import UsageError

TEMPLATES = {
    "minimal": "one robot that goes back and forth",
    "door": "a flying robot, a walking one, and a closed door that they find",
    "team": "three robots on one floor, with models and an obstacle type of their own",
}
"""The purpose of each template; the texts are beside this module."""

DEFAULT = "door"


def template_text(name: str) -> str:
    """The YAML of a template."""
    folder = Path(__file__).with_name("templates")
    return (folder / f"{name}.yaml").read_text(encoding="utf-8")


def write_text(text: str, path: Path, force: bool = False) -> None:
    """Write a scenario to a file, whole or not at all. Raises UsageError if that cannot be
    done, or if the file exists and may not be replaced (``force``)."""
    try:
        number, part = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
        try:
            with os.fdopen(number, "w", encoding="utf-8") as file:
                file.write(text)
            Path(part).chmod(0o644)
            if force:
                Path(part).replace(path)
            else:
                os.link(part, path)  # unlike a renaming it fails if the name is taken
        finally:
            with contextlib.suppress(FileNotFoundError):
                Path(part).unlink()
    except FileExistsError:
        raise UsageError(
            f"{path} exists already\n    choose another name, or replace it with --force"
        ) from None
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror or error}") from error
