"""Fleet files as commands write and read them, the message of each error, values, the schema."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from once import ROOT, SCENARIOS, beside, from_yaml
from safenav import Diagnostic, InputError, Scenario, built_in, load_scenario, load_scenario_text
from safenav.fleet import file as fleet_file
from safenav.scenario.model import Failures
from safenav.scenario.yaml.keys import schema_text
from scenario.mistakes import disagreement, keys_of, mistakes, places
from warm import Done, safenav

CASE = SCENARIOS / "case_study_1.yaml"
FILES = from_yaml(beside(__file__, "fleet_files.yaml"))
HEAD = "safenav-fleet: 1\ntransport: ros2\n"
SCHEMA = json.loads(schema_text(fleet_file.FleetKeys))


def rehearsed(fleet: str, folder: Path, scenario: Path = CASE) -> Done:
    """A rehearsal with a fleet file: its first moments, which read the file."""
    (folder / "fleet.yaml").write_text(fleet)
    words = (scenario, "--fleet", folder / "fleet.yaml", "--rehearse", "--time-limit", "1")
    return safenav("drive", *words, "--no-map")


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
        scenario = tmp_path / "plan.yaml"
        scenario.write_text(yaml.safe_dump({"safenav": 1, "map": world, "robots": robots}))
        done = rehearsed(fleet, tmp_path, scenario)
        assert done.returncode in (0, 3), done.stderr


@pytest.mark.parametrize("case", FILES["mistakes"], ids=lambda case: case["told"])
def test_an_error_is_reported_with_its_position(case: dict[str, str], tmp_path: Path) -> None:
    done = rehearsed(case["file"] if "file" in case else HEAD + case["text"], tmp_path)
    assert done.returncode == 2 and case["told"] in done.stderr
    assert "fleet.yaml" in done.stderr


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
                "two has no service for 'lift', which crate needs",
                "two has no service for 'lift', which parcel needs",
                "fetch has no service for 'unlock', which gate needs",
            ],
        ),
    ],
    ids=["none missing", "some missing"],
)
def test_actions_without_service_are_reported(robots: str, told: list[str], tmp_path: Path) -> None:
    yard = Path(__file__).parent / "scenarios/crate_and_gate.yaml"
    done = rehearsed(HEAD + robots, tmp_path, yard)
    found = [line for line in done.stderr.splitlines() if "service" in line]
    assert len(found) == len(told) and all(map(str.__contains__, found, told)), done.stderr


@pytest.mark.parametrize(
    ("network", "told"),
    [
        ("interface: wlan9", "network interface 'wlan9'\n    this machine has lo"),
        ('peers: ["127.0.0.1:7410", "robot 1"]', "'robot 1' is not the address of a robot"),
        ('peers: ["::1"]', "'::1' is not the address of a robot"),
        ('peers: ["127.0.0.1:port"]', "'127.0.0.1:port' is not the address of a robot"),
        ('peers: ["127.0.0.1:99999"]', "ports are 1 to 65535"),
    ],
)
def test_an_unknown_network_interface_or_peer_is_refused(
    network: str, told: str, tmp_path: Path
) -> None:
    """cyclonedds would end the process for a peer whose name it does not know."""
    pytest.importorskip("cyclonedds", reason="the ROS 2 transport needs the extra 'ros2'")
    text = CASE.read_text().replace("map:\n", "map:\n  resolution: 2.0\n")
    (tmp_path / "plan.yaml").write_text(text)
    (tmp_path / "fleet.yaml").write_text(f"{HEAD}network: {{domain: 9, {network}}}\n")
    done = safenav("drive", tmp_path / "plan.yaml", "--fleet", tmp_path / "fleet.yaml")
    assert done.returncode == 2 and told in done.stderr


def loaded(text: str, folder: Path, scenario: Scenario | None = None) -> fleet_file.FleetFile:
    """A fleet file; by default of case study 1."""
    (folder / "fleet.yaml").write_text(text)
    return fleet_file.load_fleet(folder / "fleet.yaml", scenario or load_scenario(CASE))


def test_keys_of_a_robot_override_the_defaults_of_the_fleet(tmp_path: Path) -> None:
    fleet = loaded(json.dumps(FILES["own"]), tmp_path)
    assert fleet.transport is fleet_file.TransportKind.ROS2
    assert fleet.network == fleet_file.Network(7, "wlan0", ("10.0.0.7",))
    assert fleet.failures == Failures(retries=0, timeout=9.0)
    scan = fleet_file.ScanUse(built_in().obstacles["door"])
    assert fleet.stations == {
        "quad": fleet_file.Station("/quad", speed=0.4, scan=scan),
        "digit": fleet_file.Station(
            *("/d", 0.3, 0.8, 3.0, scan, "seen", fleet_file.TfUse("/tf", "digit/base_link")),
            act={"push": "open_door"},
        ),
    }
    jsonschema.validate(FILES["own"], SCHEMA)


@pytest.mark.parametrize("side", [0.4, 1.0, 2.0])
def test_default_tolerances_fit_the_region(side: float, tmp_path: Path) -> None:
    """By default, messages stay on the machine."""
    text = CASE.read_text().replace("map:\n", f"map:\n  resolution: {side}\n")
    fleet = loaded(HEAD + "robots: {quad: {follow: {}}}\n", tmp_path, load_scenario_text(text))
    assert fleet.network == fleet_file.Network(0, "lo", ("127.0.0.1",))
    assert fleet.stations["quad"].tolerance == pytest.approx(min(0.3, 0.3 * side))


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
