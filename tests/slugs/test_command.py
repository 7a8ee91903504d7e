"""Whole runs of the command: options, streams, exit statuses and messages."""

import json
import re
from pathlib import Path

from slugs.commands import FOLLOW, STRATEGY, failure, run


def test_version_is_the_one_of_the_build(own_slugs: Path, folder: Path) -> None:
    """One number, declared in CMakeLists.txt."""
    cmake = Path(__file__).resolve().parents[2] / "slugs" / "CMakeLists.txt"
    declared = re.search(r"project\(slugs VERSION ([0-9.]+)", cmake.read_text())
    assert declared is not None
    done = run(own_slugs, folder, "--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"slugs {declared[1]}\n", "")


def test_strategy_goes_to_the_file_or_to_standard_output(own_slugs: Path, folder: Path) -> None:
    """The same bytes either way, and whatever way the specification comes."""
    to_stdout = run(own_slugs, folder, *STRATEGY, "follow.structuredslugs")
    to_file = run(own_slugs, folder, *STRATEGY, "follow.structuredslugs", "out.json")
    from_stdin = run(own_slugs, folder, *STRATEGY, "-", text=FOLLOW)
    dash = run(own_slugs, folder, "-", "-", *STRATEGY, text=FOLLOW)
    assert to_file.stdout == ""
    assert json.loads(to_stdout.stdout)["variables"] == [
        "light@0.0.2",
        "light@1",
        "at@0.0.2",
        "at@1",
    ]
    assert (folder / "out.json").read_text() == to_stdout.stdout
    assert from_stdin.stdout == dash.stdout == to_stdout.stdout
    text = run(own_slugs, folder, "--explicitStrategy", "follow.structuredslugs").stdout
    assert text.startswith(
        "State 0 with rank 0 -> <light@0.0.2:0, light@1:0, at@0.0.2:0, at@1:0>\n"
    )


def test_strategy_and_counterstrategy_are_verified(own_slugs: Path, folder: Path) -> None:
    """With both options there is a certificate for either verdict."""
    both = ("--explicitStrategy", "--counterStrategy", "--jsonOutput")
    for name, status in (("follow", 0), ("stuck", 10)):
        file = f"{name}.structuredslugs"
        assert run(own_slugs, folder, *both, file, "out.json").returncode == status
        assert failure(folder / file, folder / "out.json", counter=status == 10) is None
        (folder / "out.json").unlink()
    # Either option alone prints nothing on the other verdict.
    for name, option in (("stuck", "--explicitStrategy"), ("follow", "--counterStrategy")):
        done = run(own_slugs, folder, option, f"{name}.structuredslugs", "out.json")
        assert done.returncode == (10 if name == "stuck" else 0)
        assert not (folder / "out.json").exists()


def test_translation_is_the_same_game(own_slugs: Path, folder: Path) -> None:
    """It has no integers, reads back and has the same strategy."""
    assert run(own_slugs, folder, "--translate", "follow.structuredslugs", "t").returncode == 0
    translated = (folder / "t").read_text()
    assert translated.startswith("[INPUT]\nlight@0.0.2\nlight@1\n\n[OUTPUT]\nat@0.0.2\nat@1\n")
    assert "..." not in translated.replace("# limits of light:0...2", "").replace(
        "# limits of at:0...2", ""
    )
    direct = run(own_slugs, folder, *STRATEGY, "follow.structuredslugs")
    assert run(own_slugs, folder, *STRATEGY, "t").stdout == direct.stdout
    again = run(own_slugs, folder, "--translate", "t").stdout
    assert run(own_slugs, folder, *STRATEGY, "-", text=again).stdout == direct.stdout


def test_translation_keeps_the_order_of_declarations(own_slugs: Path, folder: Path) -> None:
    """In slugsin it is the order of the file, whoever owns the variables."""
    text = "[OUTPUT]\nb\n\n[INPUT]\na\n\n[OUTPUT]\nc\n\n[SYS_TRANS]\n| a c'\n"
    assert run(own_slugs, folder, "--translate", "-", text=text).stdout == text
