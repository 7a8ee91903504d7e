"""Build the wheel that installs without a compiler, and name the platforms that it runs on.

    python packaging/wheel.py dist [PROGRAM]

PROGRAM is a compiled synthesizer to put into it; without it one is compiled, as a release should
be.

The wheel holds Python files and one program. On Linux the program is linked statically, so it
asks nothing of the system but its kernel: the wheel may then call itself manylinux_2_17, which
is the oldest promise that pip still reads (PEP 600). The script looks into the program before
it says so. Elsewhere the tag of the build stays.
"""

from __future__ import annotations

import platform
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = "safenav/_bin/slugs"
MACHINES = {62: "x86_64", 183: "aarch64"}
"""ELF's numbers of the processors that the wheels are built for (e_machine)."""

_DYNAMIC, _INTERPRETER = 2, 3
"""Program headers (p_type) that only a program with shared libraries has."""


def build(folder: Path, program: Path | None = None) -> Path:
    """The wheel, in ``folder``, under its final name; ``program``: the compiled synthesizer."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        settings = _settings(Path(scratch) / "build", program)
        _run("pip", "wheel", str(ROOT), "--no-deps", "--quiet", "-w", scratch, *settings)
        (built,) = Path(scratch).glob("*.whl")
        if platform.system() == "Linux":
            machine = machine_of(program_in(built))
            tags = f"manylinux_2_17_{machine}.manylinux2014_{machine}.musllinux_1_1_{machine}"
            _run("wheel", "tags", "--remove", "--platform-tag", tags, str(built))
            (built,) = Path(scratch).glob("*.whl")
        wheel = folder / built.name
        wheel.write_bytes(built.read_bytes())
    return wheel


def _settings(compiled: Path, program: Path | None) -> list[str]:
    """A build of its own: nothing of a developer's build folder gets into the wheel."""
    settings = ["cmake.define.SLUGS_PORTABLE=ON", f"build-dir={compiled}"]
    settings += [] if program is None else [f"cmake.define.SLUGS_PROGRAM={program.resolve()}"]
    return [word for setting in settings for word in ("--config-settings", setting)]


def program_in(wheel: Path) -> bytes:
    """The synthesizer in a wheel. Raises KeyError if there is none."""
    with zipfile.ZipFile(wheel) as archive:
        return archive.read(PROGRAM)


def machine_of(program: bytes) -> str:
    """The processor that a static ELF program runs on.

    Raises ValueError if it is no 64 bit ELF program, needs a shared library, or runs on a
    processor that has no wheels.
    """
    if program[:6] != b"\x7fELF\x02\x01":
        raise ValueError(f"{PROGRAM} is no 64 bit little endian ELF program")
    (machine,) = struct.unpack_from("<H", program, 18)
    (headers,) = struct.unpack_from("<Q", program, 32)
    size, count = struct.unpack_from("<HH", program, 54)
    kinds = {struct.unpack_from("<I", program, headers + i * size)[0] for i in range(count)}
    if kinds & {_DYNAMIC, _INTERPRETER}:
        raise ValueError(f"{PROGRAM} needs shared libraries: it would not run everywhere")
    if machine not in MACHINES:
        raise ValueError(f"{PROGRAM} is for the processor {machine}, which has no wheels")
    return MACHINES[machine]


def _run(module: str, *arguments: str) -> None:
    subprocess.run([sys.executable, "-m", module, *arguments], check=True, cwd=ROOT)


if __name__ == "__main__":
    print(build(*map(Path, sys.argv[1:] or ["dist"])))
