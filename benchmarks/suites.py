"""The measured cases: the time that each should take, and where the files come from."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import families
import large
import published

Mode = Literal["strategy", "verdict"]


@dataclass(frozen=True)
class Case:
    """One file in one mode. Seconds are CPU seconds; `upstream` and `prototype` are quoted."""

    name: str
    file: Path
    mode: Mode
    bar: float | None = None
    prototype: float | None = None
    upstream: str = ""


@dataclass(frozen=True)
class Bar:
    file: str
    mode: Mode
    seconds: float | None
    prototype: float | None
    upstream: str


GENERATED = {
    "generated/regions_12x12_adversary": (12, 12),
    "generated/regions_20x30_adversary": (20, 30),
}

# Upstream SLUGS and the prototype as measured once on a 2-core machine of this kind: quoted, not
# measured here.  Give upstream's binary with --binary to measure it on the spot.
BARS = (
    Bar("safe-nav-locomotion/coop_0_cassie.structuredslugs", "strategy", 1.0, 1.8, "458"),
    Bar("safe-nav-locomotion/coop_0_quad.structuredslugs", "strategy", 0.25, 0.5, "63"),
    Bar(
        "safe-nav-locomotion/Belief_Evasion_coarse_cdc_map.structuredslugs",
        "strategy",
        1.7,
        3.4,
        "191 to 282",
    ),
    Bar(
        "safe-nav-locomotion/Belief_Evasion_fine_abstraction.structuredslugs",
        "strategy",
        7.0,
        13.5,
        "> 500",
    ),
    Bar("slugs/basicEvasion.structuredslugs", "strategy", 2.5, 4.7, "> 498"),
    Bar("generated/regions_12x12_adversary", "strategy", 2.0, 4.0, "61"),
    Bar("generated/regions_20x30_adversary", "strategy", None, 4.0, "61"),
    Bar("gr1/bunny_many_goals_8.slugsin", "strategy", 0.5, None, "26"),
    # A huge strategy, 586,471 nodes: the bar is 100,000 nodes per second.
    Bar("gr1/genbuf_10.slugsin", "strategy", 5.86, None, ""),
    Bar("gr1/genbuf_20.slugsin", "verdict", 1.0, None, "> 60"),
    Bar("gr1/synt15_10.slugsin", "verdict", 1.0, None, "26"),
    Bar("gr1/jcss12_4.slugsin", "verdict", 5.0, None, "> 60"),
    *(Bar(f"gr1/synt15_{n}.slugsin", "verdict", 1.0, None, "") for n in (24, 25, 28, 30)),
)
# Published families at sizes that the corpus need not have, rewritten, and large simple texts:
# the bars of the verdict.
WRITTEN = {
    "amba_6": (published.amba(6), 3.0),
    "amba_8": (published.amba(8), 7.0),
    "amba_10": (published.amba(10), 40.0),
    "genbuf_60": (published.genbuf(60), 3.0),
    "genbuf_80": (published.genbuf(80), 5.0),
    "genbuf_100": (published.genbuf(100), 8.0),
    **{f"synt15_{n}_written": (published.synt15(n), 1.0) for n in (31, 37, 45)},
    "bunny_20": (published.bunny(20), 2.0),
    "bunny_50": (published.bunny(50), 25.0),
    "belief_7x13_2": (published.belief(7, 13, 2), 5.0),
    "belief_7x13_3": (published.belief(7, 13, 3), 15.0),
    "sum_of_3000": (large.long_sum(3000), 1.0),
    "pairs_20000": (large.pairs(20000), 5.0),
}
SUFFIXES = (".slugsin", ".structuredslugs")
SMALL_BAR = 0.02
NOT_SMALL = ("basicEvasion", "two_customer_waiter")


def corpus_folder() -> Path | None:
    """The folder of published specifications: SAFENAV_CORPUS, or beside the repository."""
    named = os.environ.get("SAFENAV_CORPUS")
    beside = Path(__file__).resolve().parents[2] / "shared" / "corpus"
    folder = Path(named) if named else beside
    return folder if (folder / "expected.csv").is_file() else None


def corpus_suite(scratch: Path) -> list[Case]:
    """The files with a bar, then the small ones; without the corpus only the generated one."""
    corpus = corpus_folder()
    cases = []
    for bar in BARS:
        if bar.file in GENERATED:
            file = _write(scratch, bar.file, families.regions(*GENERATED[bar.file], "four"))
        elif corpus is None:
            continue
        else:
            file = corpus / bar.file
        name = Path(bar.file).name.split(".")[0]
        cases.append(Case(name, file, bar.mode, bar.seconds, bar.prototype, bar.upstream))
    cases += [
        Case(name, _write(scratch, f"written_{name}", text), "verdict", seconds)
        for name, (text, seconds) in WRITTEN.items()
    ]
    cases.append(
        Case("read_60_mb", _write(scratch, "read_60_mb", large.literals(60)), "verdict", 1.0)
    )
    if corpus is not None:
        for file in sorted((corpus / "slugs").iterdir()):
            if file.suffix in SUFFIXES and file.name.split(".")[0] not in NOT_SMALL:
                cases.append(Case(f"small/{file.stem}", file, "strategy", SMALL_BAR))
    return cases


def families_suite(scratch: Path) -> list[Case]:
    """Rising sizes of every generated family."""
    texts = {
        **{f"grid_{n}x{n}": families.grid(n, n) for n in (16, 32, 64)},
        **{f"walls_{n}x{n}": families.grid(n, n, walls=True) for n in (16, 32, 64)},
        **{f"four_{n}x{n}": families.grid(n, n, "four") for n in (9, 12, 20)},
        **{f"king_{n}x{n}": families.grid(n, n, "king") for n in (9, 12, 20)},
        **{f"regions_{n}x{n}": families.regions(n, n, "four") for n in (9, 12, 16)},
        **{f"goals_12x12_{k}": families.grid(12, 12, "four", goals=k) for k in (8, 16, 32)},
        **{f"requests_16_{k}": families.requests(16, k) for k in (4, 6, 8)},
        **{f"arbiter_{k}": families.arbiter(k) for k in (4, 7, 10)},
    }
    return [
        Case(name, _write(scratch, name, text), mode)
        for name, text in texts.items()
        for mode in _MODES
    ]


_MODES: tuple[Mode, ...] = ("verdict", "strategy")


def _write(scratch: Path, name: str, text: str) -> Path:
    file = scratch / f"{Path(name).name}.structuredslugs"
    file.write_text(text)
    return file
