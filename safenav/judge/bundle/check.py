"""Check a bundle: the proof that robots followed their rules in a run, by proven strategies.

    python3 -I -S check.py BUNDLE [--json]

BUNDLE is a folder or a .zip. Exit status 0: accepted; 1: refused, with the first reason; 2: not a
bundle; 3: exceeds the limits of this checker. Only Python's standard library is needed.

The folder ``judge`` judges each line of the trace. ``judge/bundle`` adds ``keeps``, ``apart`` and
``follows``: each strategy obeys the scenario, strategies and plans keep rivals apart, and the run
follows them. You must trust this program and Python, the truth of the trace, and the robots'
mobility. The last lines of the output name the parts that were not compared.
"""

import argparse
import hashlib
import json
import re
import stat
import sys
import zipfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    own = Path(__file__).resolve().parent
    parts = [*(own / "judge").rglob("*")]
    unread = [path for path in (*own.glob("__pycache__"), *own.glob("judge.*")) if path.exists()]
    unread += [p for p in parts if p.is_symlink() or (p.suffix != ".py" and not p.is_dir())]
    unread += [p for p in parts if p.is_dir() and (p.suffix or p.with_suffix(".py").exists())]
    if unread:  # no compiled code, and no package named like a module
        sys.exit(
            f"refused: Python may run {unread[0]} in place of a part of this checker: remove it"
        )
    sys.dont_write_bytecode = True  # leave the bundle unchanged
    sys.path.append(str(own))  # last: no file of the bundle hides a standard module

try:
    from safenav.judge.bundle.evidence import Evidence
    from safenav.judge.bundle.strategies import RefusedError, require
    from safenav.judge.engine import FACTS, judge
    from safenav.judge.lines import NotATraceError
    from safenav.judge.world import TooLargeError
    from safenav.strict_json import read_json
except (ImportError, SyntaxError) as error:
    this = sys.version.split()[0]
    sys.exit(
        f"refused: a part of this checker is missing, damaged or not for Python {this}: {error}"
    )
loaded = Path(sys.modules[Evidence.__module__].__file__ or "").resolve().parents[2]
if __name__ == "__main__" and loaded != own:
    sys.exit(f"refused: Python runs the checker of {loaded}: use python3 -I -S")

VERSION = 5
MOST_BYTES = 100_000_000
"""Maximum bytes of a file of a bundle; its values take about 20 times as much."""
KNOWN = re.compile(
    r"(?as)trace\.jsonl|index\.html|check\.py|judge/(\w+/)*\w+\.py"
    r"|source/(?!(.*/)?\.*(/|$))[^\\]+"  # no parent folder, no empty name
)
"""Names of files that trace lines need not name."""
SOURCE = "source/"
UNCOMPARED = {
    "index.html": "the page index.html",
    SOURCE: "the source of the scenario (safenav check reads it again, if it is in the bundle)",
}


@dataclass(frozen=True)
class Judged:
    """The result of a check: its ``verdict`` (accepted, refused, too large or not a bundle) and
    reason, the established claims, and the parts that were not compared. A claim has ``id``,
    ``kind``, ``text`` and ``evidence``: pairs of a file and a line or None."""

    verdict: str
    reason: str = ""
    claims: list[dict[str, Any]] = field(default_factory=list)
    not_compared: list[str] = field(default_factory=list)

    @property
    def accepted(self) -> bool:
        return self.verdict == "accepted"


def open_bundle(place: Path) -> dict[str, Any]:
    """Return the files of a bundle. Refuse unless each file equals that of the manifest."""
    if place.is_dir():
        found = [path for path in place.rglob("*") if path.is_symlink() or not path.is_dir()]
        plain = all(path.is_file() and not path.is_symlink() for path in found)
        require(plain, "a bundle has files only: no links, no devices")
        files: dict[str, Any] = {path.relative_to(place).as_posix(): path for path in found}
        sizes = [path.stat().st_size for path in found]
    else:
        archive = zipfile.ZipFile(place)
        listed = [entry for entry in archive.infolist() if entry.filename[-1] != "/"]
        files = {entry.filename: zipfile.Path(archive, entry.filename) for entry in listed}
        require(len(files) == len(listed), "two files of the archive have one name")
        kinds = {stat.S_IFMT(entry.external_attr >> 16) for entry in listed}
        require(kinds <= {0, stat.S_IFREG}, "a bundle has files only: no links, no devices")
        sizes = [entry.file_size for entry in listed]
    if max(sizes, default=0) > MOST_BYTES or sum(sizes) > 10 * MOST_BYTES:
        raise TooLargeError(f"a file exceeds {MOST_BYTES} bytes, or all files ten times that")
    text = files.pop("manifest.json").read_bytes()
    if len(text) > MOST_BYTES // 10:
        raise TooLargeError(f"the manifest exceeds {MOST_BYTES // 10} bytes")
    manifest = read_json(text)
    known = (manifest["format"], manifest["version"]) == ("safenav-bundle", VERSION)
    require(known, f"not a bundle of version {VERSION}; an older one has its own check.py")
    different = sorted({*files} ^ {*manifest["files"]})
    require(not different, f"missing, or not in the manifest: {', '.join(different)}")
    for path, file in files.items():
        data = file.read_bytes()
        facts = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        require(facts == manifest["files"][path], f"{path} is not the file that the manifest names")
        own = re.match(r"strategies/(.*?)\.", path)
        require(not own or own[1] == facts["sha256"], f"{path} is not named by its sha256")
    return files


def examine(files: dict[str, Any], run: Evidence) -> None:
    """Refuse a bundle whose trace breaks a rule or has an unproven part."""
    trace = files["trace.jsonl"].read_bytes()
    found = judge(trace.splitlines(keepends=True), [*FACTS, *run.rules()])
    if found.findings:
        first = found.findings[0]
        raise RefusedError(f"trace.jsonl, line {first.line}: {first.explanation} ({first.rule})")
    for note in found.notes:
        if not (note.line in run.proven and note.rule in ("end", "negative")):
            raise TooLargeError(f"trace.jsonl, line {note.line}: {note.explanation}")
    loose = sorted(f for f in files if not (f in run.named or KNOWN.fullmatch(f)))
    require(not loose, f"no line of this bundle names {', '.join(loose)}")
    run.finish(found.strays, found.hands)


def check(place: Path) -> Judged:
    """Check a bundle."""
    if not ((place / "manifest.json").is_file() or zipfile.is_zipfile(place)):
        return Judged("not a bundle", "expected a folder with a manifest.json, or a .zip of one")
    try:
        files = open_bundle(place)
        run = Evidence(files)
        examine(files, run)
    except TooLargeError as error:
        return Judged("too large", str(error))
    except (RefusedError, NotATraceError) as error:
        return Judged("refused", str(error))
    except Exception as error:
        return Judged("refused", f"a file is not as documented: {error!r}")
    left = [what for name, what in UNCOMPARED.items() if name in (SOURCE, *files)]
    if all(claim["kind"] != "outcome" for claim in run.claims):
        left.append("the end of the run: its trace ends before its outcome")
    return Judged("accepted", claims=run.claims, not_compared=left)


def main() -> int:
    parser = argparse.ArgumentParser(description="Check a bundle of safenav.")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--json", action="store_true", help="print what is established as JSON")
    options = parser.parse_args()
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    found = check(options.bundle)
    if options.json:
        print(json.dumps(asdict(found)))
    else:
        shown = [f"  {claim['id']}: {claim['text']}" for claim in found.claims]
        shown += [f"  not compared: {what}" for what in found.not_compared]
        last = f"{found.verdict}: {found.reason}" if found.reason else found.verdict
        for line in (*shown, last):  # printable
            print("".join(c if c.isprintable() else ascii(c)[1:-1] for c in line))
    return {"accepted": 0, "refused": 1, "not a bundle": 2, "too large": 3}[found.verdict]


if __name__ == "__main__":
    sys.exit(main())
