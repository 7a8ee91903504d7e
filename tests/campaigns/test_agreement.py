"""``check`` reports the verdict, form and assumptions with which ``run`` begins.

``SAFENAV_FUZZ=5000`` compares a thousand teams.
"""

import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml

import warm
from campaigns.judge.literal import lives
from campaigns.judge.mission import read_mission
from drawn import loads
from safenav.team.team import team_of
from support.missions import mission

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // 5 or 20
TOLD = ("verdict", "form", "allows", "assumptions")


def expected_form(data: dict[str, Any], name: str) -> str | None:
    """The form of the patrol of a robot that shares its floor with no other; None: it has none
    by the letter. Raises KeyError for other robots."""
    written, read = data["robots"][name]["objective"], read_mission(data)
    robot = next(one for one in read.robots if one.name == name)
    alone = not read.conflicts[name] and data.get("coordination") != "assignable"
    if "patrol" not in written or not alone:
        raise KeyError(name)
    first = 1 if robot.start[0] in robot.targets[1] else 0
    if lives(read, robot, (robot.start, first)):
        return "literal"
    if "form" in written:
        return None
    other = lives(read, robot, (robot.start, 1 - first))
    return "other_memory" if other else "alternation"


@pytest.mark.slow
def test_check_reports_the_verdicts_and_forms_that_a_run_begins_with(tmp_path: Path) -> None:
    seen: Counter[str] = Counter()
    differ = []
    for seed in range(COUNT):
        data, scenario = loads(lambda n: mission("narrow", n) | {"limits": {"ticks": 3}}, seed)
        planned = {each.name for each in team_of(scenario).members if each.planned}
        file, trace = tmp_path / f"{seed}.yaml", tmp_path / f"{seed}.jsonl"
        file.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        checked = warm.safenav("check", "--json", file)
        run = warm.safenav("run", file, "--no-map", "--trace", trace)
        assert 2 not in (checked.returncode, run.returncode), (seed, run.stdout)
        said = {one["robot"]: one for one in json.loads(checked.stdout)["robots"]}
        lines = [json.loads(line) for line in trace.read_text().splitlines()]
        begun: dict[str, Any] = {}
        for line in lines:
            if line["type"] == "synthesis" and line["reason"] == "initial":
                begun.setdefault(line["robot"], line)
        realizable = all(one["verdict"] == "realizable" for one in said.values())
        if (checked.returncode == 0) != realizable or realizable == (
            lines[-1].get("outcome") == "unrealizable"
        ):
            differ.append((seed, checked.returncode, lines[-1]))
        for name, one in said.items():
            line = begun.get(name)
            if line is None:
                if realizable and name not in planned:
                    differ.append((seed, name, "run has no synthesis"))
                continue
            seen[f"{line['verdict']} {line.get('form')}"] += 1
            ours, theirs = ([x.get(key) for key in TOLD] for x in (one, line))
            if ours != theirs:
                differ.append((seed, name, ours, theirs))
            try:
                wanted = expected_form(data, name)
            except KeyError:
                continue
            seen["judged"] += 1
            found = line["form"] if line["verdict"] == "realizable" else None
            if found != wanted:
                differ.append((seed, name, found, f"the judge: {wanted}"))
    assert not differ, f"{len(differ)} of {seen}: {differ[:20]}"
    assert seen["judged"] > COUNT // 12, seen
