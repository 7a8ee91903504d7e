"""The library: the programs of docs/library.md and docs/tutorial.md run as they are printed, and
type checkers accept them; pools of processes have the same scenarios, results and errors."""

import os
import pickle
import re
import sys
from pathlib import Path

import pytest
from msgspec.structs import replace

import safenav
from children import ran
from once import ROOT
from safenav import Diagnostic, InputError, Outcome, UsageError

TEXT, TUTORIAL = (
    (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("library.md", "tutorial.md")
)
PROGRAMS: list[str] = re.findall(r"^```python\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
FILES = dict(re.findall(r'^```\w+ title="(.+?)"\n(.*?)^```', TUTORIAL, re.MULTILINE | re.DOTALL))
HELLO = safenav.load_scenario(ROOT / "scenarios" / "hello.yaml")


def run(program: str, folder: Path) -> str:
    environment = {**os.environ, "SAFENAV_CACHE": str(folder / "cache")}
    words = [sys.executable, "-W", "error", "-c", program]
    done = ran(words, cwd=folder, env=environment, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_programs_of_the_library_page_run(tmp_path: Path) -> None:
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    assert len(PROGRAMS) == 2
    for program in PROGRAMS:
        run(program, tmp_path)


def test_the_members_of_a_mission_that_the_page_names_exist() -> None:
    mission = safenav.Mission(HELLO)
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


def test_importing_safenav_loads_no_submodule(tmp_path: Path) -> None:
    program = (
        "import sys, safenav; print([m for m in sys.modules if m.startswith('safenav.')]);"
        "print(set(safenav.__all__) <= set(dir(safenav)))"
    )
    assert run(program, tmp_path) == "[]\nTrue\n"


def test_a_mission_refuses_calls_out_of_order() -> None:
    with pytest.raises(UsageError, match=r"'hello\.yaml' is not a Scenario"):
        safenav.Mission("hello.yaml")  # type: ignore[arg-type]
    mission = safenav.Mission(HELLO)
    for call in (mission.step, mission.give_up):
        with pytest.raises(UsageError, match="before start"):
            call()
    with pytest.raises(TypeError, match="pickle its scenario or its result"):
        pickle.dumps(mission)
    result = mission.run()
    assert result.outcome is Outcome.COMPLETED
    assert pickle.loads(pickle.dumps((HELLO, result))) == (HELLO, result)
    assert replace(result, line=9) == result != replace(result, tick=1)  # as from a file
    with pytest.raises(UsageError, match="after the end"):
        mission.step()
    with pytest.raises(UsageError, match="second time"):
        mission.run()


def test_a_pickled_error_keeps_its_message() -> None:
    found = [Diagnostic("a.yaml", 3, 1, "unknown key", "did you mean"), Diagnostic("", 0, 0, "b")]
    error = InputError(found)
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), str(copy), vars(copy)) == (type(error), str(error), vars(error))
