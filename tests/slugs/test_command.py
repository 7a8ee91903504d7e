"""Whole runs of the command: options, streams, exit statuses, files and limits."""

import json
import re
import resource
import signal
import subprocess
import time
from pathlib import Path

import pytest

# The robot follows a light that comes back again and again.
FOLLOW = """
[INPUT]
light: 0...2
[OUTPUT]
at: 0...2
[ENV_INIT]
light = 0
[SYS_INIT]
at = 0
[ENV_TRANS]
light' <= light + 1 & light <= light' + 1
[SYS_TRANS]
at' <= at + 1 & at <= at' + 1
[ENV_LIVENESS]
light' = 2
[SYS_LIVENESS]
at' = light'
"""
# The same, but the robot cannot move.
STUCK = FOLLOW.replace("at' <= at + 1", "at' = at").replace("at' = light'", "at' = 1")
# A counter that takes 2^30 steps to its goal: nobody waits for the end of that.
ENDLESS = """
[OUTPUT]
count: 0...1073741823
[SYS_INIT]
count = 0
[SYS_TRANS]
count' = count + 1
[SYS_LIVENESS]
count' = 1073741823
"""
# All different: the diagram has a node for each subset of the values.
CROWDED = (
    "[OUTPUT]\n"
    + "".join(f"x{i}: 0...15\n" for i in range(12))
    + "[SYS_TRANS]\n"
    + "".join(f"x{i}' != x{j}'\n" for i in range(12) for j in range(i))
)
STRATEGY = ("--explicitStrategy", "--jsonOutput")
OPTIONS = (
    "--realizability",
    "--explicitStrategy",
    "--counterStrategy",
    "--check",
    "--translate",
    "--serve",
    "--jsonOutput",
    "--stats",
    "--sysInitRoboticsSemantics",
    "--biasForAction",
    "--timeout",
    "--memory",
    "--nodes",
    "--help",
    "--version",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the specifications above."""
    for name, text in (
        ("follow", FOLLOW),
        ("stuck", STUCK),
        ("endless", ENDLESS),
        ("crowded", CROWDED),
        ("broken", "[INPUT]\nx: 0...\n"),
    ):
        (tmp_path / f"{name}.structuredslugs").write_text(text)
    return tmp_path


def run(
    binary: Path, folder: Path, *arguments: str, text: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run the command in the folder."""
    return subprocess.run(
        [binary, *arguments],
        cwd=folder,
        input=text,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
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
    for status in ("0 ", "1 ", "2 ", "3 ", "4 ", "10"):
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
    for name, kind, status in (("follow", (), 0), ("stuck", ("--counterStrategy",), 10)):
        file = f"{name}.structuredslugs"
        assert run(own_slugs, folder, *both, file, "out.json").returncode == status
        assert run(own_slugs, folder, *kind, "--check", "out.json", file).returncode == 0
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
        (("--json", "x"), "unknown option '--json'\n  hint: did you mean --jsonOutput?"),
        (("-x",), "unknown option '-x'"),
        (("--symbolicStrategy", "x"), "--symbolicStrategy of SLUGS is not supported"),
        (("--interactiveStrategy", "x"), "--interactiveStrategy of SLUGS is not supported"),
        (("--computeCNFFormOfTheSpecification", "x"), "of SLUGS is not supported"),
        (("--timeout", "soon", "x"), "found 'soon' after --timeout, expected a positive number"),
        (("--timeout=-1", "x"), "found '-1' after --timeout"),
        (("--memory", "nan", "x"), "found 'nan' after --memory"),
        (("--nodes", "1.5", "x"), "found '1.5' after --nodes, expected a positive whole number"),
        (("--nodes", "9", "x"), "--nodes limits what --explicitStrategy lists"),
        (("--timeout",), "option --timeout needs a value: SECONDS"),
        (("--realizability=yes", "x"), "option --realizability takes no value"),
        (("--jsonOutput", "x"), "--jsonOutput needs --explicitStrategy or --counterStrategy"),
        (("--realizability", "--explicitStrategy", "x"), "exclude each other"),
        (("--translate", "--check", "s", "x"), "exclude each other"),
        (("--check", "-", "-"), "cannot both come from standard input"),
        (("x", "y"), "OUTFILE 'y' has no use here"),
        (("--explicitStrategy", "x", "y", "z"), "found 'z', expected at most FILE and OUTFILE"),
        (("nowhere",), "cannot read 'nowhere': No such file or directory"),
        (("/",), "cannot read '/': Is a directory"),
        (("--check", "nowhere", "follow.structuredslugs"), "cannot read 'nowhere'"),
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--explicitStrategy", "follow.structuredslugs", "no/x"), "cannot write 'no/x'"),
        (("--explicitStrategy", "follow.structuredslugs", "/"), "cannot write '/': Is a directory"),
        (("--translate", "follow.structuredslugs", "no/x"), "cannot write 'no/x'"),
        (("--stats", "no/x", "follow.structuredslugs"), "cannot write 'no/x'"),
    ],
)
def test_an_output_that_cannot_be_opened_costs_no_solution(
    own_slugs: Path, folder: Path, arguments: tuple[str, ...], message: str
) -> None:
    """Exit status 4, as for output that cannot be written."""
    before = sorted(folder.iterdir())
    done = run(own_slugs, folder, *arguments)
    assert done.returncode == 4
    assert message in done.stderr
    assert "RESULT" not in done.stderr
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("how", ["2>&-", "2>/dev/full"])
def test_a_verdict_that_cannot_be_told_is_an_error(own_slugs: Path, folder: Path, how: str) -> None:
    """Standard error is closed or full: exit status 4, and no file gets what it should say."""
    command = f'"$0" --explicitStrategy follow.structuredslugs out.txt {how}'
    done = subprocess.run(["/bin/sh", "-c", command, own_slugs], cwd=folder, check=False)
    assert done.returncode == 4
    assert not (folder / "out.txt").exists()


def test_two_dashes_end_the_options(own_slugs: Path, folder: Path) -> None:
    """So that a file may have any name."""
    (folder / "--odd").write_text(FOLLOW)
    assert run(own_slugs, folder, "--realizability", "--", "--odd").returncode == 0


def test_statistics_are_json(own_slugs: Path, folder: Path) -> None:
    """Also for an unrealizable specification, and also on standard error."""
    run(own_slugs, folder, "--stats", "stats.json", "follow.structuredslugs")
    stats = json.loads((folder / "stats.json").read_text())
    assert stats["verdict"] == "realizable"
    assert (stats["inputs"], stats["outputs"]) == (2, 2)
    assert stats["vacuous_win"] is False
    done = run(own_slugs, folder, "--stats", "-", "stuck.structuredslugs")
    assert json.loads(done.stderr[done.stderr.index("{") :])["verdict"] == "unrealizable"


def test_a_vacuous_win_is_told(own_slugs: Path, folder: Path) -> None:
    """An environment that gets stuck makes any guarantee realizable."""
    text = FOLLOW.replace("[SYS_TRANS]", "light' > light\n[SYS_TRANS]")
    done = run(own_slugs, folder, "--stats", "stats.json", "-", text=text)
    assert done.returncode == 0
    assert json.loads((folder / "stats.json").read_text())["vacuous_win"] is True


@pytest.mark.parametrize(
    ("limit", "file", "message"),
    [
        (("--timeout", "0.2"), "endless", "slugs: time limit reached while "),
        (("--memory", "1"), "crowded", "slugs: memory limit reached while "),
    ],
)
def test_a_limit_ends_the_run_in_order(
    own_slugs: Path, folder: Path, limit: tuple[str, str], file: str, message: str
) -> None:
    """Exit status 3, how far it got, statistics, and no strategy."""
    out = ("--stats", "stats.json", *STRATEGY, f"{file}.structuredslugs", "out.json")
    before = sorted(folder.iterdir())
    done = run(own_slugs, folder, *limit, *out)
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1].startswith(message)
    assert json.loads((folder / "stats.json").read_text())["verdict"] == "unknown"
    assert sorted(folder.iterdir()) == sorted([*before, folder / "stats.json"])


def test_a_strategy_with_too_many_nodes_is_given_up(own_slugs: Path, folder: Path) -> None:
    """The verdict stands, and nothing is written; as many nodes as there are may be listed."""
    whole = run(own_slugs, folder, *STRATEGY, "follow.structuredslugs")
    count = len(json.loads(whole.stdout)["nodes"])
    enough = run(own_slugs, folder, "--nodes", str(count), *STRATEGY, "follow.structuredslugs")
    assert (enough.returncode, enough.stdout) == (0, whole.stdout)
    limit = ("--nodes", str(count - 1))
    done = run(own_slugs, folder, *limit, *STRATEGY, "follow.structuredslugs", "out.json")
    assert done.returncode == 3
    assert done.stderr.splitlines()[-2].startswith("RESULT: Specification is realizable")
    assert done.stderr.splitlines()[-1].startswith("slugs: node limit reached while ")
    assert not (folder / "out.json").exists()


def _long_line(pieces: int) -> str:
    """A specification whose one constraint has this many operators."""
    return "[OUTPUT]\na\nb\n[SYS_TRANS]\n" + "| a & b " * pieces + "a\n"


def _large_strategy(nodes: int) -> str:
    """A strategy of FOLLOW's variables that is read for a while and then wrong."""
    node = '{"rank": 0, "state": [0, 0, 0, 0], "trans": [0]}'
    many = ", ".join(f'"{i}": {node}' for i in range(nodes))
    names = '["light@0.0.2", "light@1", "at@0.0.2", "at@1"]'
    return f'{{"version": 0, "variables": {names}, "nodes": {{{many}}}}}'


@pytest.mark.parametrize("command", [(), ("--translate",), ("--check", "strategy.json")])
@pytest.mark.parametrize(
    ("limit", "message"),
    [
        (("--timeout", "0.005"), "slugs: time limit reached"),
        (("--memory", "2"), "slugs: memory limit reached"),
    ],
)
def test_limits_hold_while_reading(
    own_slugs: Path,
    folder: Path,
    command: tuple[str, ...],
    limit: tuple[str, str],
    message: str,
) -> None:
    (folder / "long.slugsin").write_text(_long_line(1_000_000))
    (folder / "strategy.json").write_text(_large_strategy(100_000))
    file = "follow.structuredslugs" if "--check" in command else "long.slugsin"
    done = run(own_slugs, folder, *limit, *command, file)
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1].startswith(message)
    assert done.stdout == ""


def test_a_time_limit_ends_waiting_for_input(own_slugs: Path, folder: Path) -> None:
    """Standard input that never comes."""
    with subprocess.Popen(
        [own_slugs, "--timeout", "0.1", "-"],
        cwd=folder,
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.wait(timeout=300) == 3
        assert process.stderr is not None
        assert "slugs: time limit reached while reading" in process.stderr.read()


def test_a_sum_has_no_more_bits_than_its_value_needs(own_slugs: Path, folder: Path) -> None:
    """3,000 terms: the formulas of their sum stay in 40 MB, as diagrams and before."""
    total = " + ".join(["x"] * 3000)
    text = f"[OUTPUT]\nx: 0...7\n[SYS_INIT]\nx = 7\n[SYS_TRANS]\n{total} = 21000\nx' = x\n"
    done = run(own_slugs, folder, "--memory", "40", "-", text=text)
    assert "RESULT: Specification is realizable." in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_ends_the_run_in_order(
    own_slugs: Path, folder: Path, number: signal.Signals
) -> None:
    """An older strategy stays as it was, and no temporary file remains."""
    (folder / "out.json").write_text("older")
    before = sorted(folder.iterdir())
    with subprocess.Popen(
        [own_slugs, *STRATEGY, "endless.structuredslugs", "out.json"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("slugs ")
        time.sleep(0.1)
        process.send_signal(number)
        errors = process.stderr.read()
        assert process.wait(timeout=300) == 3
    assert errors.startswith("slugs: interrupted while ")
    assert sorted(folder.iterdir()) == before
    assert (folder / "out.json").read_text() == "older"


def test_an_interrupt_ends_waiting_for_input(own_slugs: Path, folder: Path) -> None:
    """Standard input that never comes."""
    with subprocess.Popen(
        [own_slugs, "-"], cwd=folder, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("slugs ")
        time.sleep(0.1)
        process.send_signal(signal.SIGTERM)
        assert process.stderr.read().startswith("slugs: interrupted while reading")
        assert process.wait(timeout=300) == 3


def test_output_that_is_lost_is_an_error(own_slugs: Path, folder: Path) -> None:
    """A full disk and a closed pipe: exit status 4 and the reason."""
    with Path("/dev/full").open("w") as full:
        process = subprocess.run(
            [own_slugs, *STRATEGY, "follow.structuredslugs"],
            cwd=folder,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert process.returncode == 4
    assert "cannot write to standard output: No space left on device" in process.stderr
    done = run(own_slugs, folder, *STRATEGY, "follow.structuredslugs", "/dev/full")
    assert done.returncode == 4
    assert "cannot write '/dev/full': No space left on device" in done.stderr
    with subprocess.Popen(
        [own_slugs, *STRATEGY, "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as piped:
        assert piped.stdin is not None
        assert piped.stdout is not None
        assert piped.stderr is not None
        piped.stdout.close()
        piped.stdin.write(FOLLOW)
        piped.stdin.close()
        assert "cannot write to standard output: Broken pipe" in piped.stderr.read()
        assert piped.wait(timeout=300) == 4


def test_a_file_that_grows_too_large_leaves_nothing(own_slugs: Path, folder: Path) -> None:
    """The older strategy stays when the new one does not fit."""
    (folder / "out.json").write_text("older")
    before = sorted(folder.iterdir())

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    process = subprocess.run(
        [own_slugs, *STRATEGY, "follow.structuredslugs", "out.json"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        preexec_fn=small_files,
    )
    assert process.returncode == 4
    assert "cannot write 'out.json': File too large" in process.stderr
    assert sorted(folder.iterdir()) == before
    assert (folder / "out.json").read_text() == "older"


def test_the_file_keeps_its_mode_and_links(own_slugs: Path, folder: Path) -> None:
    """Renaming over a link would cut it; a new file has the mode that the umask gives."""
    (folder / "real.json").write_text("older")
    (folder / "real.json").chmod(0o600)
    (folder / "link.json").symlink_to("real.json")
    assert run(own_slugs, folder, *STRATEGY, "follow.structuredslugs", "link.json").returncode == 0
    assert (folder / "link.json").is_symlink()
    assert (folder / "real.json").read_text().startswith("{")
    assert (folder / "real.json").stat().st_mode & 0o777 == 0o600
    (folder / "plain").touch()
    run(own_slugs, folder, *STRATEGY, "follow.structuredslugs", "new.json")
    assert (folder / "new.json").stat().st_mode == (folder / "plain").stat().st_mode
