"""Fleet files: their values, and the message of each error."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from once import beside, from_yaml
from safenav import Diagnostic, InputError, Scenario, load_scenario, load_scenario_text
from safenav.fleet import file as fleet_file
from safenav.fleet.file import template_text
from safenav.fleet.robots import unserved
from safenav.scenario.lint import imprecise
from safenav.scenario.model import Failures
from scenario.mistakes import disagreement, keys_of, mistakes, places
from warm import safenav

ROOT = Path(__file__).parents[2]
CASE = ROOT / "scenarios" / "case_study_1.yaml"
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


@pytest.mark.parametrize(("namespace", "found"), [("/lab/a/", "/lab/a/odom"), ("/", "/odom")])
def test_names_are_below_the_namespace_unless_absolute(
    namespace: str, found: str, tmp_path: Path
) -> None:
    fleet = loaded(f"{HEAD}robots: {{digit: {{namespace: {namespace}}}}}\n", tmp_path)
    assert fleet.stations["digit"].pose_topic == found
    assert [fleet.stations["quad"].path(topic) for topic in ("odom", "/s")] == ["/quad/odom", "/s"]


PAGES = [p.name for p in sorted((ROOT / "docs").glob("drive*.md"))]


@pytest.mark.parametrize("page", PAGES)
def test_fleet_files_of_the_documentation_load(page: str, tmp_path: Path) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found = re.findall(r"^```yaml[^\n]*\n(safenav-fleet:.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert found
    for fleet in found:
        names = from_yaml(fleet)["robots"]
        robots = {
            name: {"model": "quadcopter", "start": k, "objective": {"hold": k}}
            for k, name in enumerate(names)
        }
        world = {"grid": ["." * 8] * 8}
        scenario = yaml.safe_dump({"safenav": 1, "map": world, "robots": robots})
        stations = loaded(fleet, tmp_path, load_scenario_text(scenario)).stations
        assert stations.keys() == {*names}


@pytest.mark.parametrize(("side", "tolerance"), [(2.0, 0.3), (1.0, 0.2), (0.6, 0.18)])
def test_robots_arrive_within_their_regions_by_the_template(
    side: float, tolerance: float, tmp_path: Path
) -> None:
    """A robot as large as a region reaches into the next one whatever the tolerance."""
    text = f"""
safenav: 1
map: {{resolution: {side}, grid: ["####", "#..#", "####"]}}
catalogue: {{robots: {{cart: {{mobility: free, layer: ground, size: 0.6, speed: 1}}}}}}
robots: {{a: {{model: cart, start: 5, objective: {{visit: [6, 5]}}}}}}
"""
    scenario = load_scenario_text(text)
    station = loaded(template_text(scenario), tmp_path, scenario).stations["a"]
    assert station.tolerance == pytest.approx(tolerance)
    assert side == 0.6 or not list(imprecise(scenario, {"a": tolerance}))


@pytest.mark.parametrize("name", ["case_study_1", "beam", "hello"])
def test_the_template_loads_and_fits_the_schema(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(ROOT / "scenarios" / f"{name}.yaml")
    text = template_text(scenario)
    fleet = loaded(text, tmp_path, scenario)
    assert set(fleet.stations) == {robot.name for robot in scenario.robots}
    for robot in scenario.robots:
        assert set(fleet.stations[robot.name].act) == set(robot.capabilities)
    jsonschema.validate(from_yaml(text), SCHEMA)
    scans = {station.scan and station.scan.obstacle for station in fleet.stations.values()}
    expected = {"case_study_1": "door", "beam": "beam"}
    assert scans == {expected.get(name)}


@pytest.mark.parametrize("side", [0.4, 1.0, 2.0])
def test_default_distances_end_inside_the_region(side: float, tmp_path: Path) -> None:
    """And by default nothing leaves the machine."""
    text = CASE.read_text().replace("map:\n", f"map:\n  resolution: {side}\n")
    fleet = loaded(HEAD + "defaults: {follow: {}}\n", tmp_path, load_scenario_text(text))
    assert fleet.network == fleet_file.Network(0, "lo", ("127.0.0.1",))
    station = fleet.stations["quad"]
    assert station.tolerance == pytest.approx(min(0.3, 0.3 * side))
    assert station.off(side) == pytest.approx(min(0.25, 0.25 * side))


@pytest.mark.parametrize("case", FILES["mistakes"], ids=lambda case: case["told"])
def test_an_error_is_reported_with_its_position(case: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        loaded(case["file"] if "file" in case else HEAD + case["text"], tmp_path)
    assert case["told"] in str(error.value)
    assert "fleet.yaml" in str(error.value)


def test_new_writes_a_fleet_file(tmp_path: Path) -> None:
    done: Any = safenav("new", "--fleet", CASE, cwd=tmp_path)
    assert done.returncode == 0 and "--fleet fleet.yaml --rehearse" in done.stderr
    loaded((tmp_path / "fleet.yaml").read_text(), tmp_path)


SERVED = (
    "robots: {fetch: {act: {unlock: key}}, one: {act: {lift: grip}}, two: {act: {lift: grip}}}\n"
)


@pytest.mark.parametrize(
    ("robots", "told"),
    [
        (SERVED, []),
        (
            SERVED.replace("unlock: key", "").replace("lift: grip}}}", "lfit: grip}}}"),
            [
                "two has no service for 'lift', which a crate needs",
                "two has no service for 'lift', which a parcel needs",
                "fetch has no service for 'unlock', which a gate needs",
                "a service for 'lfit', which no robot can perform",
            ],
        ),
    ],
    ids=["all", "some"],
)
def test_actions_without_services_are_named(robots: str, told: list[str], tmp_path: Path) -> None:
    yard = load_scenario_text(beside(__file__, "scenarios/crate_and_gate.yaml"))
    found = [*unserved(yard, loaded(HEAD + robots, tmp_path, yard))]
    assert len(found) == len(told) and all(map(str.__contains__, found, told)), found


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
