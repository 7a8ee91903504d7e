"""The programs in docs/library.md and docs/tutorial.md run as they are printed, and type checkers
accept them."""

import json
import os
import re
import sys
from pathlib import Path

import pytest

import safenav
from children import ran

ROOT = Path(__file__).parents[2]
TEXT, TUTORIAL = (
    (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("library.md", "tutorial.md")
)
PROGRAMS: list[str] = re.findall(r"^```python\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
FILES = dict(re.findall(r'^```\w+ title="(.+?)"\n(.*?)^```', TUTORIAL, re.MULTILINE | re.DOTALL))


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


def test_a_world_moves_robots_one_region_at_a_time_and_never_into_closed_ones(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    from safenav.run.checked import check_trace

    probe = """
class Watched(MyRobots):
    def move(self, robot, pose):
        before, after = divmod(self.at[robot.name], 11), divmod(pose.region, 11)
        assert sum(abs(a - b) for a, b in zip(before, after)) <= 1, "a step is one region"
        assert self.shutter is None or pose.region != self.shutter.region
        super().move(robot, pose)

MyRobots = Watched
plan = """
    (tmp_path / "lab.yaml").write_text(FILES["lab.yaml"])
    told = run(FILES["drive.py"].replace("\nplan = ", probe, 1), tmp_path, environment)
    assert told.startswith("completed after")
    lines = (tmp_path / "real.jsonl").read_text(encoding="utf-8").splitlines()
    (resolved,) = [r for r in map(json.loads, lines) if r["type"] == "resolved"]
    assert (resolved["robot"], resolved["obstacle"]) == ("pete", "shutter@38")
    assert check_trace(tmp_path / "real.jsonl").findings == ()


def test_the_programs_of_the_page_run(tmp_path: Path, environment: dict[str, str]) -> None:
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    assert len(PROGRAMS) == 2
    for program in PROGRAMS:
        run(program, tmp_path, environment)


def test_members_of_a_mission_that_the_page_names_exist() -> None:
    mission = safenav.Mission(safenav.load_scenario(ROOT / "scenarios" / "hello.yaml"))
    mission.start()
    for path in re.findall(r"`mission\.([\w.]+)", TEXT):
        found: object = mission
        for name in path.split("."):
            assert hasattr(found, name), path
            found = getattr(found, name)
    mission.give_up()


def test_type_checkers_accept_the_programs(tmp_path: Path) -> None:
    from mypy import api

    programs = [*PROGRAMS, FILES["drive.py"], FILES["together.py"]]
    files = [tmp_path / f"program_{number}.py" for number in range(len(programs))]
    for file, program in zip(files, programs, strict=True):
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
