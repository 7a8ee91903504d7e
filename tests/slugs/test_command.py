"""Whole runs of the command: options, streams, exit statuses and messages."""

import json
import re
from pathlib import Path

import pytest

from slugs.commands import FOLLOW, STRATEGY, failure, run

OPTIONS = (
    "--realizability",
    "--explicitStrategy",
    "--counterStrategy",
    "--translate",
    "--jsonOutput",
    "--sysInitRoboticsSemantics",
    "--biasForAction",
    "--timeout",
    "--memory",
    "--nodes",
    "--help",
    "--version",
)


def test_version_is_the_one_of_the_build(own_slugs: Path, folder: Path) -> None:
    """One number, declared in CMakeLists.txt."""
    cmake = Path(__file__).resolve().parents[2] / "slugs" / "CMakeLists.txt"
    declared = re.search(r"project\(slugs VERSION ([0-9.]+)", cmake.read_text())
    assert declared is not None
    done = run(own_slugs, folder, "--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"slugs {declared[1]}\n", "")


def test_help_names_all_options_and_exit_statuses(own_slugs: Path, folder: Path) -> None:
    """Grouped, with examples, on standard output, for any terminal."""
    done = run(own_slugs, folder, "--help")
    assert (done.returncode, done.stderr) == (0, "")
    for option in OPTIONS:
        assert f"\n  {option} " in done.stdout
    for status in ("0 ", "2 ", "3 ", "4 ", "10"):
        assert f"\n  {status} " in done.stdout
    assert "Usage: slugs [options] FILE [OUTFILE]" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 90


@pytest.mark.parametrize(
    ("name", "status", "result"),
    [
        ("follow", 0, "RESULT: Specification is realizable."),
        ("stuck", 10, "RESULT: Specification is unrealizable."),
    ],
)
@pytest.mark.parametrize("option", [(), ("--realizability",), STRATEGY, ("--explicitStrategy",)])
def test_the_verdict_is_a_line_and_an_exit_status(
    own_slugs: Path, folder: Path, name: str, status: int, result: str, option: tuple[str, ...]
) -> None:
    """Banner and RESULT on standard error; standard output holds a strategy or nothing."""
    done = run(own_slugs, folder, *option, f"{name}.structuredslugs")
    assert done.returncode == status
    banner, *lines = done.stderr.splitlines()
    assert banner.startswith("slugs ")
    assert lines == [result]
    assert (done.stdout != "") == (status == 0 and "--explicitStrategy" in option)


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


def test_strategy_and_counterstrategy_hold_up(own_slugs: Path, folder: Path) -> None:
    """With both options there is a certificate for either verdict."""
    both = ("--explicitStrategy", "--counterStrategy", "--jsonOutput")
    for name, status in (("follow", 0), ("stuck", 10)):
        file = f"{name}.structuredslugs"
        assert run(own_slugs, folder, *both, file, "out.json").returncode == status
        assert failure(folder / file, folder / "out.json", counter=status == 10) is None
        (folder / "out.json").unlink()
    # Either option alone is silent about the other verdict.
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no input FILE given"),
        (("--explicitStrateg", "x"), "unknown option '--explicitStrateg'\n  hint: did you mean"),
        (("--symbolicStrategy", "x"), "--symbolicStrategy of SLUGS is not supported"),
        (("--computeCNFFormOfTheSpecification", "x"), "of SLUGS is not supported"),
        (("--timeout", "soon", "x"), "found 'soon' after --timeout, expected a positive number"),
        (("--nodes", "1.5", "x"), "found '1.5' after --nodes, expected a positive whole number"),
        (("--nodes", "9", "x"), "--nodes limits what --explicitStrategy lists"),
        (("--timeout",), "option --timeout needs a value: SECONDS"),
        (("--realizability=yes", "x"), "option --realizability takes no value"),
        (("--jsonOutput", "x"), "--jsonOutput needs --explicitStrategy or --counterStrategy"),
        (("--realizability", "--explicitStrategy", "x"), "exclude each other"),
        (("x", "y"), "OUTFILE 'y' has no use here"),
        (("--explicitStrategy", "x", "y", "z"), "found 'z', expected at most FILE and OUTFILE"),
        (("nowhere",), "cannot read 'nowhere': No such file or directory"),
        (("/",), "cannot read '/': Is a directory"),
        (("broken.structuredslugs",), "broken.structuredslugs:2:8: error: found the end"),
    ],
)
def test_bad_usage_is_explained(
    own_slugs: Path, folder: Path, arguments: tuple[str, ...], message: str
) -> None:
    """Exit status 2, a message on standard error, and nothing else happens."""
    before = sorted(folder.iterdir())
    done = run(own_slugs, folder, *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stdout == ""
    assert "RESULT" not in done.stderr
    assert sorted(folder.iterdir()) == before


def test_two_dashes_end_the_options(own_slugs: Path, folder: Path) -> None:
    """So that a file may have any name."""
    (folder / "--odd").write_text(FOLLOW)
    assert run(own_slugs, folder, "--realizability", "--", "--odd").returncode == 0
