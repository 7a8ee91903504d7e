"""Check a bundle: the proof that a run of robots followed its rules, by proven strategies.

    python3 -I -S check.py BUNDLE [--json]

BUNDLE is a folder or a .zip. Exit status 0: accepted; 1: refused, with the first reason; 2: not a
bundle; 3: exceeds the limits of this checker. Only Python's standard library is needed.

The folder ``audit`` has the rules of a run: each move is legal, obstacles are resolved by robots
that can, negatives are proven, the outcome is true. The first broken rule refuses the bundle.
``Evidence`` is one more rule: check_strategies.py shows the guarantees of each strategy, or that no
strategy exists, and each move is a successor of its strategy, a stay, a backtrack from an obstacle
or a step of a joint plan. The following stays trusted: this program and Python; the translation of
the YAML file to scenario.json (its grid is compared); the truth of the trace; the mobility of the
robots.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import zipfile
from html import escape
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    own = Path(__file__).resolve().parent
    parts = [*own.glob("__pycache__"), *own.glob("check_*"), *(own / "audit").rglob("*")]
    unread = [p for p in parts if p.suffix != ".py" and (p.parent == own or not p.is_dir())]
    if unread:  # compiled code, or a package with the name of a module
        sys.exit(
            f"refused: Python may run {unread[0]} in place of a part of this checker: remove it"
        )
    sys.dont_write_bytecode = True  # a bundle stays as it is
    sys.path.append(str(own))  # last, so that no file of a bundle replaces a standard module

try:
    from safenav.audit.language import RefusedError, TooLargeError, require
    from safenav.certify.checker.check_objectives import STRICTLY, Objective
    from safenav.certify.checker.check_run import Evidence, content_of
    from safenav.certify.checker.check_strategies import Json
except (ImportError, SyntaxError) as error:
    this = sys.version.split()[0]
    sys.exit(
        f"refused: a part of this checker is missing, damaged or not for Python {this}: {error}"
    )

MOST_BYTES = 100_000_000
"""Largest file of a bundle; its values take some 20 times its size."""
KNOWN = re.compile(
    r"(trace|motion)\.jsonl|scenario\.json|index\.html"
    r"|(check|audit/(\w+/)*)\w*\.py|source/(?!\.+$)[^/\\]+"
)
"""Names of files that need no line. All others are named by the lines of the trace."""


def open_bundle(place: Path) -> tuple[dict[str, Any], Json]:
    """Return the files of a bundle and the manifest. Refuse unless each file is as the manifest
    states."""
    if place.is_dir():
        found = [path for path in place.rglob("*") if not path.is_dir()]
        plain = all(path.is_file() and not path.is_symlink() for path in found)
        require(plain, "a bundle has files only: no links, no devices")
        files: dict[str, Any] = {path.relative_to(place).as_posix(): path for path in found}
        sizes = [path.stat().st_size for path in found]
    else:
        archive = zipfile.ZipFile(place)
        listed = [entry for entry in archive.infolist() if entry.filename[-1] != "/"]
        files = {entry.filename: zipfile.Path(archive, entry.filename) for entry in listed}
        require(len(files) == len(listed), "two files of the archive have one name")
        sizes = [entry.file_size for entry in listed]
    if max(sizes, default=0) > MOST_BYTES or sum(sizes) > 10 * MOST_BYTES:
        raise TooLargeError(f"a file of more than {MOST_BYTES} bytes, or ten times that in all")
    manifest = content_of(files.pop("manifest.json"))
    known = (manifest["format"], manifest["version"]) == ("safenav-bundle", 4)
    require(known, "not a bundle of version 4; an older one has its own check.py")
    different = sorted({*files} ^ {*manifest["files"]})
    require(not different, f"{', '.join(different)} is either missing or not in the manifest")
    for path, file in files.items():
        data = file.read_bytes()
        facts = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        require(facts == manifest["files"][path], f"{path} is not the file that the manifest names")
        own = re.match(r"(?:specs|strategies)/(.*?)\.", path)
        require(not own or own[1] == facts["sha256"], f"{path} is not named by its sha256")
        if re.fullmatch(r"source/.*\.ya?ml", path):  # the map, if it is drawn there
            world = content_of(files["scenario.json"])["map"]
            text = re.sub(r"(?m)^#.*|(?<=\s)#(?![#.]*[ \t]*$).*", "", data.decode())  # no comments
            parts = re.split(r"[\[\]{},:\n]", text)
            rows = [r for p in parts for r in re.findall(r"^[\s'\"-]*([#.]+)[\s'\"-]*$", p)]
            drawn = [row for row in rows if len(row) > 1 or world["cols"] == 1]
            same = drawn == world["grid"] or {*"#."} not in map(set, drawn)
            require(same, f"the map in {path} is not that of scenario.json")
    return files, manifest


def check_page(run: Evidence) -> None:
    """Refuse unless the page states exactly the established claims."""
    shown = run.text("index.html")
    texts = [claim["text"] for claim in run.claims]
    owns = {name: Objective(robot.data["objective"]) for name, robot in run.robots.items()}
    asked = [own.proven(name, run.world, run.claims) for name, own in owns.items()]
    listed = sorted(re.findall(r'<li id="[^"]*">(.*?)<br>', shown))
    cells = re.findall(r'<td class="must">(.*?)</td>', shown)
    same = listed == sorted(map(escape, texts)) and cells == [*map(escape, asked)]
    for text in sorted((*texts, *asked), key=len, reverse=True):
        shown = shown.replace(escape(text), "")
    same = same and STRICTLY not in shown
    require(same, "index.html differs from what was established")


def check(place: Path, *, compare: bool = True) -> tuple[str, str, list[Json]]:
    """Return the verdict, the reason, and the established claims. ``compare``: they must be those
    of the manifest."""
    run, verdict, reason = None, "refused", ""
    try:
        files, manifest = open_bundle(place)
        run = Evidence(files)
        run.replay()
        same = not compare or manifest["claims"] == run.claims
        require(same, "the claims of the manifest differ from those that the evidence establishes")
        loose = sorted(f for f in files if not (f in run.named or KNOWN.fullmatch(f)))
        require(not loose, f"{', '.join(loose)} is not a file of this bundle: no line names it")
        if "index.html" in files:
            check_page(run)
        verdict = "accepted"
    except TooLargeError as error:
        verdict, reason = "too large", str(error)
    except RefusedError as error:
        reason = str(error)
    except Exception as error:
        last = f" (perhaps {run.last}, the last one that was read)" if run and run.last else ""
        reason = f"a file is not as documented{last}: {error!r}"
    where = f"trace.jsonl, line {run.number}: " if run and run.number else ""
    return verdict, where + reason, run.claims if run else []


def main() -> int:
    parser = argparse.ArgumentParser(description="Check a bundle of safenav.")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--json", action="store_true", help="print what is established as JSON")
    parser.add_argument("--any-claims", action="store_true", help="whatever the manifest claims")
    options = parser.parse_args()
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    if not (options.bundle / "manifest.json").is_file() and not zipfile.is_zipfile(options.bundle):
        print(f"{options.bundle} is not a bundle: a folder with a manifest.json, or a .zip of one")
        return 2
    verdict, reason, claims = check(options.bundle, compare=not options.any_claims)
    if options.json:
        print(json.dumps({"verdict": verdict, "reason": reason, "claims": claims}))
    else:
        shown = [f"  {claim['id']}: {claim['text']}" for claim in claims]
        for line in (*shown, f"{verdict}: {reason}" if reason else verdict):  # printable
            print("".join(c if c.isprintable() else ascii(c)[1:-1] for c in line))
    return {"accepted": 0, "refused": 1, "too large": 3}[verdict]


if __name__ == "__main__":
    sys.exit(main())
