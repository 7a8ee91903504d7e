"""Transcripts: what commands print and how they exit, word for word.

A transcript writes files (``> NAME``, then ``| LINE``) and runs commands (``$``), of safenav or of
the system; the indented lines below a command are its output, and its exit status if that is not 0.
``make golden`` rewrites them: the review of a change is its diff.
"""

import os
import re
import shlex
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from once import FOLDER, locked

Run = Callable[[list[str], Mapping[str, str]], tuple[int, str]]
"""Runs a command with more variables; returns its exit status and all its output."""

VARYING = (
    (re.compile(r"(under )?\b[\d.]+ m?s(?=,| summed| total)"), "N ms"),
    (re.compile(r"(?<=of time after )\d+ ms"), "N ms"),
    (re.compile(r"\b\d+ KiB"), "N KiB"),
    (re.compile(r"-[0-9a-f]{8}(?=/|\.jsonl)"), "-DIGEST"),
    (re.compile(r"(?<= in )[\d.]+ s(?=$|;| \()|(?<= )\d+\.\d\d$", re.MULTILINE), "N"),
    (re.compile(r'(?<=seconds": )[\d.e-]+'), "N"),
    (re.compile(r"(?<= )\d+\.\d(?= +(yes|no|-)$)", re.MULTILINE), "N"),
    (re.compile(r"(?<=a broken image: ).*"), "WHY"),
)
"""Times, sizes and words of libraries, and what a transcript has for them."""


def played(script: str, folder: Path, run: Run) -> str:
    """Return a transcript with the output that its commands give now, in a folder."""
    lines, file = list[str](), folder
    for line in script.splitlines():
        if line.startswith("    "):
            continue
        lines.append(line)
        if line.startswith("> "):
            file = folder / line[2:]
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text("")
        elif line.startswith("|"):
            with file.open("a", encoding="utf-8") as text:
                text.write(line[2:] + "\n")
        elif line.startswith("$ "):
            words = shlex.split(line[2:])
            variables = dict(word.split("=", 1) for word in words if re.match(r"[A-Z_]+=", word))
            status, said = run(words[len(variables) :], variables)
            said = said.replace(str(folder), ".")
            for pattern, instead in VARYING:
                said = pattern.sub(instead, said)
            if "synth" in words:  # the widths of its columns depend on the times
                said = re.sub(r"(?<=\S) {2,}", "  ", re.sub(r"-{2,}(?=\s)", "--", said))
            if "batch" in words:  # passed cases are listed slowest first
                rows = re.compile(r"(?:^.* passed  .*\n)+", re.MULTILINE)
                said = rows.sub(lambda found: "".join(sorted(found[0].splitlines(True))), said)
            said += f"exit {status}\n" if status else ""
            lines += [f"    {each}".rstrip() or "    ." for each in said.splitlines()]
    return "\n".join([*lines, ""])


def check(file: Path, folder: Path, run: Run) -> None:
    """Assert that the commands of a transcript print what it says, or rewrite it."""
    found = played(file.read_text(encoding="utf-8"), folder, run)
    assert "Traceback" not in found and "a defect of safenav" not in found, found
    golden(found, file)


def golden(found: str, file: Path) -> None:
    """Assert that a file has this text, or rewrite it."""
    if os.environ.get("SAFENAV_GOLDEN"):
        file.write_text(found, encoding="utf-8")
    assert found == file.read_text(encoding="utf-8")


def golden_row(name: str, found: str, file: Path) -> None:
    """Assert that a table has this row, ``NAME: FOUND``, or rewrite it."""
    with locked(Path(os.environ[FOLDER]) / f"{file.parent.name}.lock"):
        rows = dict(row.rpartition(": ")[::2] for row in file.read_text().splitlines())
        if os.environ.get("SAFENAV_GOLDEN"):
            rows[name] = found
            file.write_text("".join(f"{key}: {rows[key]}\n" for key in sorted(rows)))
    assert found == rows.get(name)


def rounded(data: Any, digits: int = 5) -> Any:
    """Return data with rounded numbers: the last digits depend on the machine."""
    if isinstance(data, float):
        return round(data, digits) + 0.0  # no negative zero
    if isinstance(data, dict):
        return {key: rounded(value, digits) for key, value in data.items()}
    return [rounded(each, digits) for each in data] if isinstance(data, list) else data


def helps() -> dict[str, str]:
    """What each command prints for ``--help``, by its name, as ``cli/transcripts/help.txt`` has it;
    ``safenav`` first."""
    text = Path(__file__).parents[1].joinpath("cli/transcripts/help.txt").read_text()
    shown = re.findall(r"^\$ (safenav.*) --help\n((?:    .*\n|      \n)+)", text, re.MULTILINE)
    return {words.split()[-1]: textwrap.dedent(page) for words, page in shown}
