"""Traces in which one robot passes an obstacle that stands are refused, alone and in a bundle.

``SAFENAV_FUZZ=5000`` tries a thousand.
"""

import json
import os
from collections import Counter
from pathlib import Path
from random import Random

import pytest
import yaml

import warm
from campaigns.generate.families import mission
from campaigns.judge.mission import read_mission
from campaigns.judge.replay import replay
from campaigns.passers import Passer, declared, excursions
from certify.making import files_of, rewrite
from certify.mutants import lines_of, with_lines
from safenav.certify.record import bundle_of_run
from safenav.errors import InputError
from safenav.judge.bundle.check import check

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // 5 or 12
PART = 250


def refused_by_the_audit(passer: Passer, file: Path) -> bool:
    file.write_text("".join(json.dumps(line) + "\n" for line in passer.lines), encoding="utf-8")
    done = warm.safenav("check", "--json", file)
    found = json.loads(done.stdout)["findings"]
    rules = {one["rule"] for one in found if one["robot"] == passer.robot}
    return done.returncode == 1 and "unresolved-obstacle" in rules


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, COUNT, PART))
def test_a_trace_in_which_a_robot_passes_a_standing_obstacle_is_refused(
    first: int, tmp_path: Path
) -> None:
    made: Counter[str] = Counter()
    accepted = []
    wanted = min(PART, COUNT - first)
    for seed in range(20 * first, 20 * (first + wanted)):
        if made.total() >= wanted:
            break
        folder = tmp_path / str(seed)
        folder.mkdir()
        data = mission("labs", seed) | {"until": {"rounds": 3}}
        (folder / "mission.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
        try:
            bundle_of_run(folder / "mission.yaml", folder / "bundle")
        except InputError:
            continue
        files = files_of(folder / "bundle")
        lines = lines_of(files)
        passers = [("declared", one) for one in declared(data, lines)]
        passers += [("excursion", one) for one in excursions(data, lines, Random(seed))]
        for kind, one in passers:
            made[kind] += 1
            if kind == "excursion":
                problems = replay(read_mission(data), one.lines).problems
                assert any(told.endswith(f"{one.robot} is in {one.obstacle}") for told in problems)
            which = (seed, kind, one.robot, one.obstacle)
            if not refused_by_the_audit(one, folder / "passer.jsonl"):
                accepted.append(("check", *which))
            changed = rewrite(folder / "bundle", with_lines(files, one.lines), folder / kind)
            verdict, reason, *_ = check(changed)
            if verdict != "refused" or one.robot not in reason:
                accepted.append(("check.py", *which, reason))
    assert not accepted, f"{len(accepted)} of {made}: {accepted[:20]}"
    assert made["declared"] >= wanted // 50
    assert made["excursion"] >= wanted // 4
