"""Fleet files: their values, and their schema."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from once import SCENARIOS, beside, from_yaml
from safenav import Diagnostic, InputError, Scenario, load_scenario, load_scenario_text
from safenav.fleet import file as fleet_file
from safenav.scenario.model import Failures
from scenario.mistakes import disagreement, keys_of, mistakes, places

CASE = SCENARIOS / "case_study_1.yaml"
SCHEMA = json.loads(fleet_file.schema_text())
FILES = from_yaml(beside(__file__, "fleet_files.yaml"))
HEAD = "safenav-fleet: 1\ntransport: ros2\n"


def loaded(text: str, folder: Path, scenario: Scenario | None = None) -> fleet_file.FleetFile:
    """A fleet file, of case study 1 unless told."""
    (folder / "fleet.yaml").write_text(text)
    return fleet_file.load_fleet(folder / "fleet.yaml", scenario or load_scenario(CASE))


def test_own_keys_win_over_defaults(tmp_path: Path) -> None:
    fleet = loaded(json.dumps(FILES["own"]), tmp_path)
    assert fleet.transport is fleet_file.TransportKind.ROS2
    assert fleet.network == fleet_file.Network(7, "wlan0", ("10.0.0.7",))
    assert fleet.failures == Failures(retries=0, timeout=9.0)
    scan = fleet_file.ScanUse("door")
    assert fleet.stations == {
        "quad": fleet_file.Station("/quad", speed=0.4, scan=scan),
        "digit": fleet_file.Station(
            *("/d", 0.3, 0.8, 3.0, scan, "seen", fleet_file.TfUse("/tf", "digit/base_link")),
            act={"push": "open_door"},
        ),
    }
    jsonschema.validate(FILES["own"], SCHEMA)


@pytest.mark.parametrize("side", [0.4, 1.0, 2.0])
def test_default_distances_end_inside_the_region(side: float, tmp_path: Path) -> None:
    """And by default nothing leaves the machine."""
    text = CASE.read_text().replace("map:\n", f"map:\n  resolution: {side}\n")
    fleet = loaded(HEAD + "defaults: {follow: {}}\n", tmp_path, load_scenario_text(text))
    assert fleet.network == fleet_file.Network(0, "lo", ("127.0.0.1",))
    station = fleet.stations["quad"]
    assert station.tolerance == pytest.approx(min(0.3, 0.3 * side))
    assert station.off(side) == pytest.approx(min(0.25, 0.25 * side))


def test_loader_and_schema_judge_errors_alike(tmp_path: Path) -> None:
    full: Any = FILES["full"]
    scenario, validator = load_scenario(CASE), jsonschema.Draft202012Validator(SCHEMA)
    path, wrong = tmp_path / "fleet.yaml", {}
    cases = [(way, case) for n, way in enumerate(places(full)) for case in mistakes(full, way, n)]
    for _, (name, data) in [((), ("none", full)), *cases]:
        path.write_text(json.dumps(data))
        found: tuple[Diagnostic, ...] = ()
        try:
            fleet_file.load_fleet(path, scenario)
        except InputError as error:
            found = error.diagnostics
        if told := disagreement(data, found, validator):
            wrong[name] = told
    assert wrong == {}
    assert len(cases) > 100
    assert keys_of(SCHEMA, set()) <= {way[-1] for way in places(full)}
