"""The programs in docs/library.md run as they are printed, and type checkers accept them."""

import json
import os
import re
import sys
from pathlib import Path

import pytest

import safenav
import warm
from children import ran

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
PROGRAMS: list[str] = re.findall(r"^```python\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
SHORTEST, BUILDING, SYNTHESIS = PROGRAMS


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    found = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    path = os.pathsep.join(entry for entry in found if entry)
    return {**os.environ, "PYTHONPATH": path, "SAFENAV_CACHE": str(tmp_path / "cache")}


def run(program: str, folder: Path, environment: dict[str, str]) -> str:
    found = ran(
        [sys.executable, "-W", "error", "-c", program], cwd=folder, env=environment, timeout=120
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_the_fleet_is_driven_through_the_door(tmp_path: Path, environment: dict[str, str]) -> None:
    from safenav.checked_trace import check_trace

    told = run(BUILDING, tmp_path, environment)
    order = [line.split("(")[0] for line in told.splitlines()]
    assert order[:4] == ["Violation", "Request", "Resolved", "End"]
    assert told.splitlines()[-1] == "every robot has met its objective for 2 rounds"
    lines = (tmp_path / "building.jsonl").read_text(encoding="utf-8").splitlines()
    records = [json.loads(line) for line in lines]
    assert records[-1]["outcome"] == "completed"
    (resolved,) = [r for r in records if r["type"] == "resolved"]
    assert (resolved["robot"], resolved["obstacle"]) == ("walker", "door@45")
    assert check_trace(tmp_path / "building.jsonl").findings == ()


def test_the_fleet_goes_one_region_at_a_time_and_never_where_a_door_is_closed(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    probe = """
class Watched(Fleet):
    def drive(self, name, x, y):
        assert (x, y) not in self.closed or name == "walker", "only the walker may push"
        last = next((way for way in reversed(self.driven) if way[0] == name), None)
        if last is not None:
            assert abs(last[1] - x) + abs(last[2] - y) == 0.5, "a step is one region"
        super().drive(name, x, y)

Fleet = Watched
if __name__"""
    told = run(BUILDING.replace("if __name__", probe, 1), tmp_path, environment)
    assert "End(" in told


def test_the_page_runs_from_top_to_bottom(tmp_path: Path, environment: dict[str, str]) -> None:
    """All programs in one folder, one after the other, and the commands about their traces."""
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    for program in (SHORTEST, BUILDING):
        run(program, tmp_path, environment)
    run(SYNTHESIS, tmp_path, environment)
    for command in re.findall(r"`safenav ((?:check|replay) \S+)`", TEXT):
        done = warm.safenav(*command.split(), cwd=tmp_path, env=environment)
        assert done.returncode == 0, done.stderr


def test_what_the_page_shows_of_a_mission_exists() -> None:
    mission = safenav.Mission(safenav.load_scenario(ROOT / "scenarios" / "hello.yaml"))
    mission.start()
    for path in re.findall(r"`mission\.([\w.]+)", TEXT):
        found: object = mission
        for name in path.split("."):
            assert hasattr(found, name), path
            found = getattr(found, name)
    assert mission.rest().robot("rover").start == mission.scenario.robot("rover").start
    mission.give_up()


def test_type_checkers_accept_the_programs(tmp_path: Path) -> None:
    from mypy import api

    files = [tmp_path / f"program_{number}.py" for number in range(len(PROGRAMS))]
    for file, program in zip(files, PROGRAMS, strict=True):
        file.write_text(program, encoding="utf-8")
    # The project's settings, so that `make lint` has checked all that the programs import.
    settings = ["--strict", "--config-file", str(ROOT / "pyproject.toml")]
    cache = ["--cache-dir", str(ROOT / ".mypy_cache")]
    report, errors, status = api.run([*settings, *cache, *map(str, files)])
    mine = [line for line in report.splitlines() if "program_" in line]
    assert mine == [], report + errors
    assert status in (0, 1), errors  # 1: stubs that the reader of the page need not have


def test_importing_safenav_loads_nothing_else(environment: dict[str, str]) -> None:
    program = (
        "import sys, safenav; print([m for m in sys.modules if m.startswith('safenav.')]);"
        "print(set(safenav.__all__) <= set(dir(safenav)))"
    )
    assert run(program, ROOT, environment) == "[]\nTrue\n"
