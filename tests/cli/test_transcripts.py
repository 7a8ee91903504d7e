"""Transcripts of commands: what they print and how they exit, word for word.

A transcript in ``transcripts/`` writes files (``> NAME``, then ``| LINE``) and runs commands
(``$``); the indented lines below a command are its output, and its exit status if that is not 0.
``make golden`` rewrites them: the review of a change is its diff.
"""

import os
import re
import shlex
import shutil
from pathlib import Path
from zipfile import ZipFile

import pytest

import warm
from once import SCENARIOS
from safenav.cli import COMMANDS, command_of

TRANSCRIPTS = Path(__file__).with_name("transcripts")
ROOT = Path(__file__).parents[2]
MAPS = ROOT / "tests" / "maps"
VARYING = (
    (re.compile(r"(under )?\b[\d.]+ m?s(?=,| summed| total)"), "N ms"),
    (re.compile(r"\b\d+ KiB"), "N KiB"),
    (re.compile(r'(?<=seconds": )[\d.e-]+'), "N"),
    (re.compile(r"(?<= )\d+\.\d(?= +(yes|no|-)$)", re.MULTILINE), "N"),
)
"""Times and sizes, and what a transcript has for them."""


def written(folder: Path) -> None:
    """Write the files that no text holds."""
    shutil.copytree(MAPS, folder / "maps")
    shutil.copytree(SCENARIOS, folder / "scenarios")
    (folder / "loop").symlink_to("loop")
    (folder / "binary").write_bytes(b"\xff\xfe\x00")
    (folder / "binary.jsonl").write_bytes(b"\xff\xfe\x00")
    (folder / "deep").write_text("[" * 100_000)
    with ZipFile(folder / "n.zip", "w") as archive:
        archive.writestr("a", "b")
    with ZipFile(folder / "b.zip", "w") as archive:
        archive.writestr("manifest.json", "{}" * 200)
    (folder / "b.zip").write_bytes((folder / "b.zip").read_bytes()[-60:])


def played(script: str, folder: Path) -> str:
    """Return a transcript with the output that its commands give now."""
    lines, file = list[str](), folder
    for line in script.splitlines():
        if line.startswith("    "):
            continue
        lines.append(line)
        if line.startswith("> "):
            file = folder / line[2:]
            file.write_text("")
        elif line.startswith("|"):
            with file.open("a", encoding="utf-8") as text:
                text.write(line[2:] + "\n")
        elif line.startswith("$ "):
            words = shlex.split(line[2:])
            variables = dict(word.split("=", 1) for word in words[: words.index("safenav")])
            env = {**os.environ, "NO_COLOR": "1", "SAFENAV_CACHE": str(folder / "cache")}
            env |= variables
            command = words[words.index("safenav") + 1 :]
            done = warm.safenav(*command, cwd=folder, env=env, together=True)
            said = done.stdout.replace(str(folder), ".")
            for pattern, instead in VARYING:
                said = pattern.sub(instead, said)
            if command[0] == "synth":  # the widths of its columns depend on the times
                said = re.sub(
                    r"(?<=\S) {2,}", "  ", re.sub(r"-{2,}(?= |$)", "--", said, flags=re.M)
                )
            said += f"exit {done.returncode}\n" if done.returncode else ""
            lines += [f"    {each}".rstrip() or "    ." for each in said.splitlines()]
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_commands_print_what_their_transcript_says(file: Path, tmp_path: Path) -> None:
    written(tmp_path)
    script = file.read_text(encoding="utf-8")
    found = played(script, tmp_path)
    assert "Traceback" not in found and "a defect of safenav" not in found
    if os.environ.get("SAFENAV_GOLDEN"):
        file.write_text(found, encoding="utf-8")
    assert found == script or os.environ.get("SAFENAV_GOLDEN")


def test_the_help_of_every_command_is_on_one_screen_with_examples_and_exit_codes() -> None:
    text = (TRANSCRIPTS / "help.txt").read_text(encoding="utf-8")
    for name in COMMANDS:
        shown = text.partition(f"$ safenav {name} --help\n")[2].partition("\n$ ")[0]
        assert "Exit codes:" in shown and "Example" in shown
        assert len(shown.splitlines()) <= 40


def test_pages_name_every_command_and_only_options_that_exist() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    texts = {page.name: page.read_text(encoding="utf-8") for page in pages}
    assert all(f"`safenav {name}" in texts["commands.md"] for name in COMMANDS)
    for page, text in texts.items():
        for name, rest in re.findall(r"safenav (\w+)((?: [^`|&#;)\n]*)?)", text):
            if name in COMMANDS:
                params = command_of(name).params
                known = {option for each in params for option in (*each.opts, *each.secondary_opts)}
                named = set(re.findall(r"(?<= )--?[a-z0-9][a-z0-9-]*", rest)) - {"--help"}
                assert named <= known, f"{page}: safenav {name} {named - known}"
