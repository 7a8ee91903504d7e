"""The gate: which small errors of safenav the tests find. ``python -m gate`` (in ``tests/``).

For each mutant of ``mutants.txt``, runs the folders that should kill it, the cheapest first, and
writes a line of ``--report``: killed by what, or survived. ``--draw`` draws the mutants anew;
``--sample 40`` plays every so many of them; ``--only WORD`` those whose line has the word. Not part
of ``make test``: it takes hours, and changes the modules of this tree while it runs.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

from gate.mutator import ROOT, Mutant, applied, drawn, read

LIST = Path(__file__).with_name("mutants.txt")
KILLERS = {
    "batch": "batch cli certify",
    "certify": "lies certify cli",
    "cli": "cli batch documentation faults",
    "explain": "explain cli",
    "fleet": "fleet campaigns/test_drives.py",
    "formula": "formula spec synthesis runtime",
    "installation": "cli install",
    "judge": "judge lies traces certify campaigns",
    "motion": "motion fleet cli",
    "pace": "motion runtime/test_live.py fleet campaigns",
    "plan": "team runtime campaigns",
    "report": "report cli studio",
    "review": "explain cli report",
    "run": "report runtime studio cli",
    "runtime": "runtime team campaigns fleet studio cli",
    "scenario": "scenario spec runtime cli studio motion",
    "solve": "runtime explain campaigns",
    "spec": "spec runtime synthesis campaigns",
    "stl": "motion formula cli",
    "studio": "studio",
    "synthesis": "synthesis cli faults certify",
    "team": "team runtime campaigns",
    "trace": "traces judge runtime cli report",
    "verify": "synthesis certify hostile proof",
    "world": "world scenario team runtime report",
}
OTHERS = "cli scenario traces judge hostile batch fleet runtime"
"""Folders for modules beside the packages."""


def killed(mutant: Mutant, run: Run) -> str:
    """Return what kills a mutant; empty if nothing does. Tests that do not end kill it, too."""
    text = applied(mutant)
    assert text is not None, mutant
    path = ROOT / mutant.path
    honest = path.read_text(encoding="utf-8")
    folders = KILLERS.get(mutant.path.split("/")[1], OTHERS).split()
    while folders:
        path.write_text(text, encoding="utf-8")
        try:
            found = run(ROOT / "tests" / folders[0])
        finally:
            path.write_text(honest, encoding="utf-8")
        if found and "::" in found and run(found):
            run.broken.append(found)  # without the error as well: again, without this test
        elif found:
            return found
        else:
            folders.pop(0)
    return ""


class Run:
    """Runs tests until the first failure. ``broken``: tests that fail in an honest tree."""

    def __init__(self, workers: int, patience: float) -> None:
        self.workers, self.patience, self.broken = workers, patience, list[str]()

    def __call__(self, tests: object) -> str:
        """The test that fails first, or why there is none; empty if all pass."""
        words = [sys.executable, "-m", "pytest", "-x", "-q", "-n", str(self.workers), str(tests)]
        words += ["-p", "no:cacheprovider", "--dist", "worksteal"]
        words += [word for each in self.broken for word in ("--deselect", each)]
        with subprocess.Popen(
            words, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True
        ) as process:
            try:
                said, _ = process.communicate(timeout=self.patience)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                return f"{tests} does not end"
        if process.returncode in (0, 5):
            return ""
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+::.*?)(?: - .*)?$", said, re.MULTILINE)
        return failed[0] if failed else f"{tests} cannot be run"


def main() -> int:
    """Play the mutants; 1 if fewer than 85 % are killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draw", action="store_true", help="draw the mutants anew")
    parser.add_argument("--sample", type=int, help="play so many of them")
    parser.add_argument("--only", default="", help="those whose line has this word")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--patience", type=float, default=1200, help="seconds for a folder")
    parser.add_argument("--report", type=Path, default=Path("gate.txt"))
    asked = parser.parse_args()
    if asked.draw:
        LIST.write_text("".join(f"{each.text}\n" for each in drawn()), encoding="utf-8")
        return 0
    lines = LIST.read_text(encoding="utf-8").splitlines()
    lines = [line for line in lines if asked.only in line]
    lines = lines[:: max(1, len(lines) // asked.sample)][: asked.sample] if asked.sample else lines
    if stale := [line for line in lines if applied(read(line)) is None]:
        parser.error(f"{len(stale)} mutants have lost their place, draw them anew: {stale[0]}")
    survivors, run = 0, Run(asked.workers, asked.patience)
    with asked.report.open("a", encoding="utf-8") as report:
        for line in lines:
            begun = time.monotonic()
            by = killed(read(line), run)
            survivors += not by
            said = f"killed by {by}" if by else "SURVIVED"
            print(f"{line}\t{said}\t{time.monotonic() - begun:.0f} s", file=report, flush=True)
    print(f"{len(lines) - survivors} of {len(lines)} mutants are killed")
    return int(survivors > 0.15 * len(lines))


if __name__ == "__main__":
    sys.exit(main())
