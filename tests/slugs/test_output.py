"""Output that cannot be written is an error, and files are kept as they were."""

import resource
import signal
import subprocess
from pathlib import Path

import pytest

from slugs.commands import STRATEGY, run


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
    own_slugs: Path, folder: Path, output: str, said: str
) -> None:
    """Exit status 4 and the reason; without a verdict no file gets a strategy."""
    command = f'"$0" {" ".join(STRATEGY)} follow.structuredslugs {output}'
    done = subprocess.run(
        ["/bin/sh", "-c", command, own_slugs], cwd=folder, stderr=subprocess.PIPE, text=True
    )
    assert done.returncode == 4
    assert said in done.stderr
    assert not (folder / "out.txt").exists()


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
