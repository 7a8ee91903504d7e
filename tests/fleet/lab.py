"""The physics simulation, watched; drives in it in this process, with their trace."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from safenav import Mission, Scenario, TraceWriter, load_scenario
from safenav.fleet.file import load_fleet
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.fleet.transport import GoalPoint
from safenav.fleet.world import FleetWorld


def watched(physics: Any) -> Any:
    """The same physics with ``contacts``: the steps of each pair that touched, as names of robots,
    ``wall`` and obstacles; ``moving``: its robots under way; ``send`` and ``log``."""
    physics.contacts, step = {}, physics._step

    def named(geom: int) -> str:
        return str(physics._model.geom(geom).name).split(".")[0].split("~")[0]

    def noted() -> None:
        step()
        for index in range(physics._data.ncon):
            pair = tuple(sorted(named(int(g)) for g in physics._data.contact[index].geom))
            if {*pair} & {*physics._bodies}:
                physics.contacts[pair] = physics.contacts.get(pair, 0) + 1

    def moving() -> list[str]:
        return sorted(name for name in physics._bodies if physics.moves(name))

    def log() -> dict[str, Any]:
        places = {name: physics._at(body)[:2] for name, body in physics._bodies.items()}
        return {
            "contacts": {" ".join(pair): count for pair, count in physics.contacts.items()},
            "standing": sorted(physics.standing),
            "regions": {name: physics._places.region(*at) for name, at in places.items()},
            "moving": moving(),
        }

    def send(name: str, x: float, y: float, yaw: float | None, number: int = 0) -> None:
        physics.navigate(name, GoalPoint(number, x, y, yaw))

    physics._step, physics.moving, physics.log, physics.send = noted, moving, log, send
    return physics


def physics_of(scenario: Path, fleet: Path) -> Any:
    """The watched physics of the robots of a scenario, which a fleet file puts into a lab."""
    plan = load_scenario(scenario)
    given = load_fleet(fleet, plan)
    return watched(SimulationTransport(plan, given).physics)


def drive_in(world: FleetWorld, plan: Scenario, path: Path) -> tuple[list[str], float]:
    """The lines of a drive in a world, and when it began; ``path``: its trace."""
    try:
        world.open()
        with TraceWriter(path) as writer:
            mission = Mission(plan, world=world, listeners=[writer])
            mission.run()
    finally:
        world.close()
    return path.read_text().splitlines(), mission.began
