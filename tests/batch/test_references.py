"""A result of a case is reused only while the files that its scenario names are unchanged."""

import os
from pathlib import Path

import pytest

from safenav.batch.search import find_cases
from safenav.certify.check import sources_of

ROBOTS = "robots: {quick: {model: quadcopter, start: 6, objective: {visit: [6, 8]}}}\n"
ROS = "resolution: 0.5\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\nnegate: 0\n"
MAPS = {
    "drawn": ("{grid: ['#####', '#...#', '#####']}", []),
    "image": ("{image: floor.pgm, rows: 1, cols: 1}", ["floor.pgm"]),
    "ros": ("{ros: maps/floor.yaml, resolution: 0.5}", ["maps/floor.yaml", "maps/floor.pgm"]),
    "movingai": ("{movingai: arena.map}", ["arena.map"]),
}


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps/floor.yaml").write_text(ROS + "image: floor.pgm\n")
    for name in ("floor.pgm", "maps/floor.pgm", "arena.map", "own.yaml", "unrelated.png"):
        (tmp_path / name).write_text("first")
    return tmp_path


def _case(folder: Path, form: str, catalogue: str = "") -> str:
    scenario = folder / "scenario.yaml"
    scenario.write_text(f"safenav: 1\nmap: {MAPS[form][0]}\n{catalogue}{ROBOTS}")
    (case,) = find_cases([str(scenario)]).cases
    return case.fingerprint


@pytest.mark.parametrize("form", MAPS)
def test_a_bundle_holds_the_scenario_and_each_file_that_it_names(files: Path, form: str) -> None:
    text = f"map: {MAPS[form][0]}\ncatalogue: own.yaml\n"
    named = {"own.yaml", *(Path(name).name for name in MAPS[form][1])}
    held = sources_of(files / "lab.yaml", text)
    assert (held.keys(), held["lab.yaml"]) == ({"lab.yaml", *named}, text.encode())
    if form == "ros":  # two files of one name, in two folders
        assert sources_of(files / "floor.yaml", text).keys() == {
            "floor.yaml",
            "_floor.yaml",
            *named,
        }


def test_a_file_that_appears_is_a_change_and_a_pipe_is_not_waited_for(files: Path) -> None:
    (files / "arena.map").unlink()
    before = _case(files, "movingai")
    (files / "arena.map").write_text("first")
    assert _case(files, "movingai") != before
    (files / "arena.map").unlink()
    os.mkfifo(files / "arena.map")
    assert _case(files, "movingai") == before


def test_the_map_that_a_matrix_puts_in_place_counts(files: Path) -> None:
    _case(files, "movingai")
    (files / "other.map").write_text("first")
    (files / "matrix.yaml").write_text(
        "batch: 1\nscenarios: [scenario.yaml]\nmatrix: {map.movingai: [arena.map, other.map]}\n"
    )

    def prints() -> dict[str, str]:
        cases = find_cases([str(files / "matrix.yaml")]).cases
        return {case.settings["map.movingai"]: case.fingerprint for case in cases}

    before = prints()
    (files / "other.map").write_text("second")
    after = prints()
    assert after["arena.map"] == before["arena.map"]
    assert after["other.map"] != before["other.map"]
