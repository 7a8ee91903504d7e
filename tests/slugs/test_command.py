"""Whole runs of the command: streams, files, limits, interrupts, odd texts, transcripts (see
``support.transcripts``), and the example of its README."""

import json
import re
import resource
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from children import ran
from once import ROOT
from slugs.conftest import FOLLOW, STRATEGY, failure, run
from support.transcripts import check

FILE = "follow.structuredslugs"
OUT = (*STRATEGY, FILE, "out.json")


def test_the_strategy_goes_to_a_file_or_standard_output(slugs_binary: Path, folder: Path) -> None:
    """The same bytes either way, and whatever way the specification comes."""
    whole = run(slugs_binary, folder, *STRATEGY, FILE).stdout
    assert json.loads(whole)["variables"] == ["light@0.0.2", "light@1", "at@0.0.2", "at@1"]
    assert run(slugs_binary, folder, *OUT).stdout == ""
    assert (folder / "out.json").read_text() == whole
    for words in ((*STRATEGY, "-"), ("-", "-", *STRATEGY)):
        assert run(slugs_binary, folder, *words, text=FOLLOW).stdout == whole


def test_with_both_options_each_verdict_has_its_automaton(slugs_binary: Path, folder: Path) -> None:
    for name, status in (("follow", 0), ("stuck", 10)):
        file = f"{name}.structuredslugs"
        done = run(slugs_binary, folder, *STRATEGY, "--counterStrategy", file, "out.json")
        assert done.returncode == status
        assert failure(folder / file, folder / "out.json", counter=status == 10) is None


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("out.txt 2>&-", ""),
        ("out.txt 2>/dev/full", ""),
        (">/dev/full", "cannot write to standard output: No space left on device"),
        (">&-", "cannot write to standard output: Bad file descriptor"),
        ("/dev/full", "cannot write '/dev/full': No space left on device"),
    ],
)
def test_output_that_cannot_be_written_is_an_error(
    slugs_binary: Path, folder: Path, output: str, said: str
) -> None:
    """Exit status 4 and the reason; without a verdict no file gets a strategy."""
    command = f'"$0" {" ".join(STRATEGY)} {FILE} {output}'
    done = ran(["/bin/sh", "-c", command, slugs_binary], cwd=folder)
    assert done.returncode == 4
    assert said in done.stderr
    assert not (folder / "out.txt").exists()


def _limited(kind: int, size: int) -> Callable[[], None]:
    def limit() -> None:
        resource.setrlimit(kind, (size, size))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    return limit


def test_output_that_does_not_fit_leaves_the_older_file(slugs_binary: Path, folder: Path) -> None:
    """The older strategy stays when the new one does not fit."""
    (folder / "out.json").write_text("older")
    before = sorted(folder.iterdir())
    done = run(slugs_binary, folder, *OUT, preexec_fn=_limited(resource.RLIMIT_FSIZE, 100))
    assert done.returncode == 4
    assert "cannot write 'out.json': File too large" in done.stderr
    assert sorted(folder.iterdir()) == before
    assert (folder / "out.json").read_text() == "older"


def test_an_overwritten_file_keeps_its_mode_and_links(slugs_binary: Path, folder: Path) -> None:
    """Renaming over a link would cut it; a new file has the mode that the umask gives."""
    (folder / "real.json").write_text("older")
    (folder / "real.json").chmod(0o600)
    (folder / "link.json").symlink_to("real.json")
    assert run(slugs_binary, folder, *STRATEGY, FILE, "link.json").returncode == 0
    assert (folder / "link.json").is_symlink()
    assert (folder / "real.json").read_text().startswith("{")
    assert (folder / "real.json").stat().st_mode & 0o777 == 0o600
    (folder / "plain").touch()
    run(slugs_binary, folder, *OUT)
    assert (folder / "out.json").stat().st_mode == (folder / "plain").stat().st_mode


@pytest.mark.parametrize(
    ("limit", "words", "message"),
    [
        (("--timeout", "0.2"), (*STRATEGY, "endless.structuredslugs", "out.json"), "time limit"),
        (("--memory", "1"), (*STRATEGY, "crowded.structuredslugs", "out.json"), "memory limit"),
        (("--timeout", "0.005"), ("long.slugsin",), "time limit"),
        (("--memory", "2"), ("--translate", "long.slugsin"), "memory limit"),
    ],
    ids=["solving", "building", "reading", "translating"],
)
def test_a_limit_ends_the_run_cleanly(
    slugs_binary: Path, folder: Path, limit: tuple[str, str], words: tuple[str, ...], message: str
) -> None:
    """Exit status 3, how far it got, and no strategy."""
    long = "[OUTPUT]\na\nb\n[SYS_TRANS]\n" + "| a & b " * 1_000_000 + "a\n"
    (folder / "long.slugsin").write_text(long)
    before = sorted(folder.iterdir())
    done = run(slugs_binary, folder, *limit, *words)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.splitlines()[-1].startswith(f"slugs: {message} reached while ")
    assert sorted(folder.iterdir()) == before


def test_a_strategy_with_too_many_nodes_exceeds_a_limit(slugs_binary: Path, folder: Path) -> None:
    """The verdict stands, and nothing is written; as many nodes as there are may be listed."""
    whole = run(slugs_binary, folder, *STRATEGY, FILE).stdout
    count = len(json.loads(whole)["nodes"])
    enough = run(slugs_binary, folder, "--nodes", str(count), *STRATEGY, FILE)
    assert (enough.returncode, enough.stdout) == (0, whole)
    done = run(slugs_binary, folder, "--nodes", str(count - 1), *OUT)
    assert done.returncode == 3
    verdict, limit = done.stderr.splitlines()[-2:]
    assert verdict.startswith("RESULT: Specification is realizable")
    assert limit.startswith("slugs: node limit reached while ")
    assert not (folder / "out.json").exists()


@pytest.mark.parametrize(
    ("number", "words", "said"),
    [
        (signal.SIGINT, (*STRATEGY, "endless.structuredslugs", "out.json"), "interrupted while "),
        (signal.SIGHUP, (*STRATEGY, "endless.structuredslugs", "out.json"), "interrupted while "),
        (signal.SIGTERM, ("-",), "interrupted while reading"),
        (None, ("--timeout", "0.1", "-"), "time limit reached while reading"),
    ],
)
def test_an_interrupt_ends_the_run_cleanly(
    slugs_binary: Path,
    folder: Path,
    number: signal.Signals | None,
    words: tuple[str, ...],
    said: str,
) -> None:
    """An older strategy stays as it was, and no temporary file remains, even while it waits for
    standard input that never comes."""
    (folder / "out.json").write_text("older")
    before = sorted(folder.iterdir())
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [slugs_binary, *words], cwd=folder, stdin=pipe, stderr=pipe, text=True
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("slugs ")
        if number is not None:
            time.sleep(0.1)
            process.send_signal(number)
        errors = process.stderr.read()
        assert process.wait(timeout=300) == 3
    assert errors.startswith(f"slugs: {said}")
    assert sorted(folder.iterdir()) == before
    assert (folder / "out.json").read_text() == "older"


def test_slugs_ends_if_its_parent_process_has_ended(slugs_binary: Path, folder: Path) -> None:
    orphan = run(slugs_binary, folder, "--version", env={"SLUGS_PARENT": "1"})
    assert orphan.returncode == -signal.SIGKILL


def test_a_sum_of_many_terms_takes_little_memory(slugs_binary: Path, folder: Path) -> None:
    """3,000 terms: the formulas of their sum stay in 40 MB, as diagrams and before."""
    total = " + ".join(["x"] * 3000)
    text = f"[OUTPUT]\nx: 0...7\n[SYS_INIT]\nx = 7\n[SYS_TRANS]\n{total} = 21000\nx' = x\n"
    assert run(slugs_binary, folder, "--memory", "40", "-", text=text).returncode == 0


def test_the_default_memory_limit_is_half_of_the_memory_available(
    slugs_binary: Path, folder: Path
) -> None:
    """A text of 60 MB where a process may have 100 MB; `--memory` lifts the limit."""
    (folder / "large.slugsin").write_text("[OUTPUT]\na\n" + ("#" * 999 + "\n") * 60_000)
    allowed = {"preexec_fn": _limited(resource.RLIMIT_AS, 100 << 20)}
    done = run(slugs_binary, folder, "large.slugsin", **allowed)
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == (
        "slugs: memory limit reached while reading the specification; the limit is half of what "
        "this machine allows, 50 MB: --memory MB sets another"
    )
    assert run(slugs_binary, folder, "--memory", "90", "large.slugsin", **allowed).returncode == 0


def test_deep_decision_diagrams_need_no_deep_stack(slugs_binary: Path, folder: Path) -> None:
    """Diagrams of 4,000 levels, and a strategy of 1,500 bits, on a stack of 128 KB."""

    def text(count: int, *, stays: bool) -> str:
        names = [f"o{k}" for k in range(count)]
        product = " ".join(["&"] * (count - 1) + [f"{name}'" for name in names])
        held = "\n".join(f"! ^ {name}' {name}" for name in names) if stays else product
        sections = ("[OUTPUT]", *names, "[SYS_INIT]", *names, "[SYS_TRANS]", held)
        return "\n".join([*sections, "[SYS_LIVENESS]", product, ""])

    small = {"preexec_fn": _limited(resource.RLIMIT_STACK, 128 << 10)}
    done = run(slugs_binary, folder, "-", text=text(4_000, stays=False), **small)
    assert done.returncode == 0, done.stderr
    done = run(slugs_binary, folder, *STRATEGY, "-", text=text(1_500, stays=True), **small)
    assert done.returncode == 0, done.stderr
    assert [node["trans"] for node in json.loads(done.stdout)["nodes"].values()] == [[0]]


NUMBER = b"[INPUT]\na\nx: 0...7\n[OUTPUT]\nready\n[SYS_TRANS]\n"
A = b"[OUTPUT]\na\n[SYS_TRANS]\n"


@pytest.mark.parametrize(
    ("text", "status"),
    [
        pytest.param(NUMBER.replace(b"\n", b"\r\n") + b"ready'\r\n", 0, id="CRLF"),
        pytest.param(b"\xef\xbb\xbf" + NUMBER, 0, id="byte order mark"),
        pytest.param(NUMBER + b"\t ready' \t", 0, id="no newline at the end"),
        pytest.param(b"[SYS_INIT]\nb\n[OUTPUT]\na\n[OUTPUT]\nb\n", 0, id="sections in any order"),
        pytest.param(b"[INPUT]\n[OUTPUT]\n", 0, id="no variables"),
        pytest.param(b"[OUTPUT]\nF\nU\n[SYS_TRANS]\nF & U\n", 0, id="variables named as operators"),
        pytest.param(
            b"[OUTPUT]\na-b\nx[1]\n[SYS_TRANS]\n| a-b' x[1]\n", 0, id="slugsin names with signs"
        ),
        pytest.param(A + b"!" * 99_999 + b"a\n", 0, id="many negations"),
        pytest.param(NUMBER + b"(" * 99_999 + b"a" + b")" * 99_999, 0, id="nested parentheses"),
        pytest.param(
            NUMBER + b"next(" + b"(" * 99_999 + b"a" + b")" * 100_000, 0, id="nested next()"
        ),
        pytest.param(NUMBER + b"a & " * 99_999 + b"a", 0, id="a long conjunction"),
        pytest.param(NUMBER + b"x + " * 999 + b"x < 3", 0, id="a long sum"),
        pytest.param(A + b"| a " * 99_999 + b"a\n", 0, id="deep prefix"),
        pytest.param(A + b"$ 1 " * 99_999 + b"a\n", 0, id="deep buffers"),
        pytest.param(b"\0", 2, id="NUL"),
        pytest.param(A + b"a\0\n", 2, id="NUL in a formula"),
        pytest.param(NUMBER + b"\xff\xfe\n", 2, id="not UTF-8"),
        pytest.param(b"\x7fELF" + bytes(range(256)) * 50, 2, id="a binary file"),
        pytest.param(NUMBER + b"(" * 99_999, 2, id="open parentheses"),
        pytest.param(A + b"$ 4000000000 a", 2, id="a huge buffer"),
        pytest.param(b"[INPUT]\n" + b"a" * 999_999 + b"\n" + b"b " * 99_999, 2, id="long lines"),
        pytest.param(NUMBER + b"x = " + b"7" * 99_999, 2, id="a long number"),
        pytest.param(b"[SYS_TRANS]\n" + b"nonsense\n" * 5000, 2, id="thousands of errors"),
    ],
)
def test_unusual_texts_are_read_or_refused(slugs_binary: Path, text: bytes, status: int) -> None:
    """Line ends, marks, depth and length that a person or a generator may produce; of a file that
    is not text an error, no crash, and nothing on the terminal that is not printable."""
    done = subprocess.run([slugs_binary, "--translate", "-"], input=text, capture_output=True)
    said = done.stderr.decode()
    assert (done.returncode, "error" in said) == (status, status == 2), said
    assert status == 2 or not said
    assert status == 0 or not done.stdout
    assert all(character.isprintable() or character == "\n" for character in said)
    assert max(map(len, said.splitlines()), default=0) < 300
    assert said.count(" error: ") <= 1000
    assert "5000 errors" in said or "nonsense" not in said


TRANSCRIPTS = Path(__file__).with_name("transcripts")


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_the_synthesizer_prints_what_the_transcript_shows(
    slugs_binary: Path, folder: Path, file: Path
) -> None:
    def run(words: list[str], variables: Mapping[str, str]) -> tuple[int, str]:
        del variables
        before = sorted(folder.iterdir())
        done = ran(["sh", "-c", '"$0" "$@" 2>&1', slugs_binary, *words[1:]], cwd=folder)
        assert sorted(folder.iterdir()) == before, "a command without OUTFILE writes nothing"
        return done.returncode, done.stdout

    check(file, folder, run)


def test_the_example_runs_as_shown(slugs_binary: Path, tmp_path: Path) -> None:
    """The page shows the specification, the command and its whole output."""
    pattern = r"```\n\$ cat (\S+)\n(.*?)\$ slugs (.*?)\n(.*?)```"
    example = re.search(pattern, (ROOT / "slugs" / "README.md").read_text(), re.DOTALL)
    assert example is not None
    name, text, words, expected = example.groups()
    (tmp_path / name).write_text(text)
    done = ran(["sh", "-c", f'"$0" {words} 2>&1', slugs_binary], cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, expected)
