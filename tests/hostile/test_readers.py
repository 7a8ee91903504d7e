"""Small files that stand for huge ones, and files that never end: each reader has its limits."""

import json
import struct
import sys
import zlib
from pathlib import Path
from typing import NamedTuple

import pytest

from hostile.attack import MOST_MB, SAFENAV, attack

LAB = """\
safenav: 1
name: lab
map: {grid: ["#####", "#...#", "#####"]}
robots: {r: {model: quadcopter, start: 6, objective: {visit: [6, 8]}}}
"""
SPEC = "[INPUT]\na\n[OUTPUT]\nb\n[SYS_TRANS]\n{0}\n"
STRATEGY = '{"variables": ["a", "b"], "nodes": {NODES}}'
NODES = '{"0": {"rank": 0, "state": [0, 0], "trans": [0]}}'


def doubling(entries: int) -> str:
    """A buffer whose last entry stands for 2^n formulas."""
    recalls = " ".join(f"^ ? {k} ? {k}" for k in range(entries - 1))
    return SPEC.format(f"$ {entries} b {recalls}")


def laughs(levels: int = 30) -> str:
    """Aliases of aliases."""
    lines = ["l0: &l0 [1, 1]"]
    lines += [f"l{k + 1}: &l{k + 1} [*l{k}, *l{k}]" for k in range(levels)]
    return LAB + "\n".join(lines) + "\n"


class Png(NamedTuple):
    """An image of zeros, of fewer or more rows than it says."""

    width: int
    height: int
    rows: int


def png(width: int, height: int, rows: int) -> bytes:
    """An image of zeros: some bytes for a hundred megabytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    body = zlib.compress(bytes((4 * width + 1) * rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def image(name: str) -> str:
    return LAB.replace(
        'map: {grid: ["#####", "#...#", "#####"]}', f"map: {{image: {name}, rows: 3, cols: 5}}"
    )


ROBOTS = "".join(
    f"  r{k}: {{model: quadcopter, start: 6, objective: {{hold: 6}}}}\n" for k in range(2000)
)
AXES = "".join(f"  limits.ticks_{k}: {{from: 0, to: 999}}\n" for k in range(12))
WIDE = "[INPUT]\na:0...2147483647\n[OUTPUT]\nb\n[ENV_INIT]\na = 0\n[SYS_TRANS]\n{0}\n"
BITS = ["a@0.0.2147483647", *(f"a@{k}" for k in range(1, 31)), "b"]
ZERO = {"rank": 0, "state": [0] * 32, "trans": [0]}
WIDE_STRATEGY = json.dumps({"variables": BITS, "nodes": {"0": ZERO}})
Files = dict[str, str | bytes | Png]

BOMBS: dict[str, tuple[Files, tuple[str, ...]]] = {
    "buffers, explained": ({"s.slugsin": doubling(22)}, ("explain", "s.slugsin")),
    "buffers, synthesized": ({"s.slugsin": doubling(60)}, ("synth", "s.slugsin")),
    "buffers, verified": (
        {"s.slugsin": doubling(40), "s.json": STRATEGY.replace("NODES", NODES)},
        ("verify", "s.slugsin", "s.json"),
    ),
    "a variable of many values": (
        {"s.slugs": SPEC.format("b").replace("\na\n", "\na:0...99999999999\n"), "s.json": "{}"},
        ("verify", "s.slugs", "s.json"),
    ),
    "an integer, verified": (
        {"s.slugs": WIDE.format("a' = a | b'"), "s.json": WIDE_STRATEGY},
        ("verify", "s.slugs", "s.json"),
    ),
    "an integer, explained": ({"s.slugs": WIDE.format("b & !b")}, ("explain", "s.slugs")),
    "brackets": (
        {"s.slugs": SPEC.format("(" * 200_000), "s.json": "{}"},
        ("verify", "s.slugs", "s.json"),
    ),
    "a node twice": (
        {
            "s.slugs": SPEC.format("b"),
            "s.json": STRATEGY.replace("NODES", NODES[:-1] + ", " + NODES[1:]),
        },
        ("verify", "s.slugs", "s.json"),
    ),
    "a strategy of brackets": (
        {"s.slugs": SPEC.format("b"), "s.json": '{"variables": ' + "[" * 300_000},
        ("verify", "s.slugs", "s.json"),
    ),
    "a strategy without end": ({"s.slugs": SPEC.format("b")}, ("verify", "s.slugs", "/dev/zero")),
    "a specification without end": ({}, ("explain", "/dev/zero")),
    "a trace without end": ({}, ("check", "/dev/zero")),
    "a motion without end": ({}, ("check", "/dev/zero", "/dev/zero")),
    "aliases": ({"s.yaml": laughs()}, ("check", "s.yaml")),
    "nesting": ({"s.yaml": LAB + "x: " + "[" * 100_000}, ("check", "s.yaml")),
    "a long number": ({"s.yaml": LAB + "seed: " + "9" * 1_000_000}, ("check", "s.yaml")),
    "a matrix": (
        {"s.yaml": LAB, "m.yaml": f"scenarios: [s.yaml]\nmatrix:\n{AXES}"},
        ("batch", "m.yaml"),
    ),
    "many robots": ({"s.yaml": LAB.split("robots")[0] + "robots:\n" + ROBOTS}, ("check", "s.yaml")),
    "a memory of many values": (
        {
            "s.yaml": LAB.replace(
                "visit: [6, 8]",
                "ltl: {memory: {m: [0, 2147483647]}, safety: [m' >= m], liveness: [region = 6]}",
            )
        },
        ("check", "s.yaml"),
    ),
    "a wide PNG": (
        {"s.yaml": image("s.png"), "s.png": Png(60_000, 60_000, 1)},
        ("draw", "s.yaml"),
    ),
    "a PNG of zeros": (
        {"s.yaml": image("s.png"), "s.png": Png(4000, 4000, 4000)},
        ("draw", "s.yaml"),
    ),
    "a PNG with more rows than it says": (
        {"s.yaml": image("s.png"), "s.png": Png(2000, 20, 20_000)},
        ("draw", "s.yaml"),
    ),
    "a PGM header": (
        {"s.yaml": image("s.pgm"), "s.pgm": b"P5 999999999 999999999 255\n"},
        ("draw", "s.yaml"),
    ),
    "a map header": (
        {"s.map": "type octile\nheight 999999\nwidth 999999\nmap\n....\n"},
        ("draw", "s.map"),
    ),
    "a huge grid": (
        {
            "s.yaml": LAB.replace(
                '"#####", "#...#", "#####"', ", ".join(['"' + "." * 1000 + '"'] * 1000)
            )
        },
        ("check", "s.yaml"),
    ),
    "a large image": (
        {"s.yaml": image("s.pgm").replace("rows: 3, cols: 5", "rows: 10000, cols: 10000")}
        | {"s.pgm": b"P5\n10000 10000\n255\n" + b"\xff" * 100},
        ("check", "s.yaml"),
    ),
    "a large map": (
        {"s.map": "type octile\nheight 3000\nwidth 3000\nmap\n" + ("." * 3000 + "\n") * 3000},
        ("draw", "s.map"),
    ),
    "a catalogue": ({"c.yaml": laughs().replace(LAB, "")}, ("new", "--catalogue", "c.yaml")),
    "a motion file": (
        {"m.jsonl": '{"type": "header", "motion": 1, "motion": 1}\n', "t.jsonl": "{}\n"},
        ("check", "m.jsonl", "t.jsonl"),
    ),
}
ALLOWED = {
    "a long number": (0, 2),
    "a memory of many values": (3,),
    "an integer, explained": (1,),
    "an integer, verified": (3,),
    "a PNG of zeros": (0, 2),
    "a PNG with more rows than it says": (0, 2),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_small_file_does_not_become_a_huge_one(name: str, tmp_path: Path) -> None:
    files, words = BOMBS[name]
    for folder in ("home", "sandbox"):
        (tmp_path / folder).mkdir()
    sandbox = tmp_path / "sandbox"
    for file, content in files.items():
        content = png(*content) if isinstance(content, Png) else content
        data = content.encode() if isinstance(content, str) else content
        assert len(data) < 10_000_000
        (sandbox / file).write_bytes(data)
    done = attack([*SAFENAV, *words], sandbox)
    assert done.flaws == ()
    assert done.status in ALLOWED.get(name, (2,)), (tmp_path / "err.txt").read_text()[:500]


def test_a_large_file_of_tiny_values_is_refused_before_they_are_made(tmp_path: Path) -> None:
    for folder in ("home", "sandbox"):
        (tmp_path / folder).mkdir()
    sandbox = tmp_path / "sandbox"
    (sandbox / "s.slugs").write_text(SPEC.format("b"))
    values = "[]," * 20_000_000
    (sandbox / "s.json").write_text(
        STRATEGY.replace("NODES", NODES[:-1] + f', "1": [{values}[]]}}')
    )
    done = attack([*SAFENAV, "verify", "s.slugs", "s.json"], sandbox)
    (sandbox / "s.json").unlink()
    assert done.flaws == () and done.status == 2
    assert "more than 6 million values" in (tmp_path / "err.txt").read_text()


def test_the_peak_is_that_of_the_program_alone(tmp_path: Path) -> None:
    """A large test process is not counted, and a large program is."""
    for folder in ("home", "sandbox"):
        (tmp_path / folder).mkdir()
    own = b"x" * (200 << 20)
    small = attack([sys.executable, "-c", ""], tmp_path / "sandbox")
    del own
    assert 0 < small.megabytes < 100 and small.flaws == ()
    large = attack([sys.executable, "-c", f"b'x' * ({MOST_MB} << 20)"], tmp_path / "sandbox")
    assert large.megabytes > MOST_MB and large.flaws == (f"{large.megabytes:.0f} MB",)
