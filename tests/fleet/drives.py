"""Drives of scenarios by fleet files in the simulation, by the command; each is made once."""

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

from once import from_yaml, made_once
from warm import safenav


def lines_of(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text().splitlines()]


@cache
def driven(scenario: str, fleet: str, goals: tuple[str, ...] = ()) -> Path:
    """The trace of a drive. ``goals``: robots that get goals although the defaults follow."""
    data = from_yaml(fleet)
    if goals:
        follow = data["defaults"].pop("follow")
        own = data.setdefault("robots", {})
        for name in from_yaml(scenario)["robots"]:
            own[name] = own.get(name, {}) | ({} if name in goals else {"follow": follow})

    def make(folder: Path) -> None:
        (folder / "hall.yaml").write_text(scenario)
        (folder / "fleet.yaml").write_text(json.dumps(data))
        words = (
            folder / "hall.yaml",
            "--fleet",
            folder / "fleet.yaml",
            "--trace",
            folder / "t.jsonl",
        )
        done = safenav("drive", *words)
        assert (folder / "t.jsonl").exists(), done.stderr

    digest = hashlib.sha256(f"{scenario}{json.dumps(data)}".encode())
    return made_once(f"drive {digest.hexdigest()[:16]}", make) / "t.jsonl"
