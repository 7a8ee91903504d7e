"""Limits of time, memory and nodes, and interrupts, end the command in order."""

import json
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from children import ran
from slugs.commands import STRATEGY, run


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
    """Exit status 3, how far it got, and no strategy."""
    out = (*STRATEGY, f"{file}.structuredslugs", "out.json")
    before = sorted(folder.iterdir())
    done = run(own_slugs, folder, *limit, *out)
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1].startswith(message)
    assert sorted(folder.iterdir()) == before


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


@pytest.mark.parametrize(
    ("command", "limit", "message"),
    [
        ((), ("--timeout", "0.005"), "slugs: time limit reached"),
        (("--translate",), ("--memory", "2"), "slugs: memory limit reached"),
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
    done = run(own_slugs, folder, *limit, *command, "long.slugsin")
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


def test_a_sum_takes_only_the_bits_of_its_value(own_slugs: Path, folder: Path) -> None:
    """3,000 terms: the formulas of their sum stay in 40 MB, as diagrams and before."""
    total = " + ".join(["x"] * 3000)
    text = f"[OUTPUT]\nx: 0...7\n[SYS_INIT]\nx = 7\n[SYS_TRANS]\n{total} = 21000\nx' = x\n"
    done = run(own_slugs, folder, "--memory", "40", "-", text=text)
    assert "RESULT: Specification is realizable." in done.stderr


@pytest.mark.parametrize(
    ("number", "words", "doing"),
    [
        (signal.SIGINT, (*STRATEGY, "endless.structuredslugs", "out.json"), ""),
        (signal.SIGHUP, (*STRATEGY, "endless.structuredslugs", "out.json"), ""),
        (signal.SIGTERM, ("-",), "reading"),
    ],
)
def test_an_interrupt_ends_the_run_in_order(
    own_slugs: Path, folder: Path, number: signal.Signals, words: tuple[str, ...], doing: str
) -> None:
    """An older strategy stays as it was, and no temporary file remains; also while it waits for
    standard input that never comes."""
    (folder / "out.json").write_text("older")
    before = sorted(folder.iterdir())
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [own_slugs, *words], cwd=folder, stdin=pipe, stderr=pipe, text=True
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("slugs ")
        time.sleep(0.1)
        process.send_signal(number)
        errors = process.stderr.read()
        assert process.wait(timeout=300) == 3
    assert errors.startswith(f"slugs: interrupted while {doing}")
    assert sorted(folder.iterdir()) == before
    assert (folder / "out.json").read_text() == "older"


def _limited(kind: int, size: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(kind, (size, size))


def test_the_default_memory_limit_is_half_of_the_memory_available(
    own_slugs: Path, folder: Path
) -> None:
    """A text of 60 MB where a process may have 100 MB; `--memory` lifts the limit."""
    (folder / "large.slugsin").write_text("[OUTPUT]\na\n" + ("#" * 999 + "\n") * 60_000)
    allowed = {"preexec_fn": _limited(resource.RLIMIT_AS, 100 << 20)}
    done = ran([own_slugs, "large.slugsin"], cwd=folder, **allowed)
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == (
        "slugs: memory limit reached while reading the specification; the limit is half of what "
        "this machine allows, 50 MB: --memory MB sets another"
    )
    assert (
        ran([own_slugs, "--memory", "90", "large.slugsin"], cwd=folder, **allowed).returncode == 0
    )


def test_deep_diagrams_need_no_deep_stack(own_slugs: Path, folder: Path) -> None:
    """Diagrams of 4,000 levels, and a strategy of 1,500 bits, on a stack of 128 KB."""

    def text(count: int, *, stays: bool) -> str:
        names = [f"o{k}" for k in range(count)]
        product = " ".join(["&"] * (count - 1) + [f"{name}'" for name in names])
        held = "\n".join(f"! ^ {name}' {name}" for name in names) if stays else product
        sections = ("[OUTPUT]", *names, "[SYS_INIT]", *names, "[SYS_TRANS]", held)
        return "\n".join([*sections, "[SYS_LIVENESS]", product, ""])

    small = {"cwd": folder, "preexec_fn": _limited(resource.RLIMIT_STACK, 128 << 10)}
    done = ran([own_slugs, "-"], input=text(4_000, stays=False), **small)
    assert done.returncode == 0, done.stderr
    done = ran([own_slugs, *STRATEGY, "-"], input=text(1_500, stays=True), **small)
    assert done.returncode == 0, done.stderr
    assert [node["trans"] for node in json.loads(done.stdout)["nodes"].values()] == [[0]]
