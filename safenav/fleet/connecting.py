"""The world of a fleet file, with the transport that it names."""

from __future__ import annotations

from safenav.extras import missing
from safenav.fleet.fleet_file import FleetFile, TransportKind
from safenav.fleet.world import FleetWorld
from safenav.scenario.model import Scenario


def fleet_world(scenario: Scenario, fleet: FleetFile) -> FleetWorld:
    """Return the world, not yet open. Raises UsageError if the transport's library is missing."""
    stations = fleet.stations
    if fleet.transport is TransportKind.ROS1:
        from safenav.fleet.ros1 import Ros1Transport

        return FleetWorld(scenario, stations, Ros1Transport(fleet.network, stations))
    if fleet.transport is TransportKind.ROS2:
        try:
            from safenav.fleet.ros2.transport import Ros2Transport
        except ImportError as error:
            raise missing("transport ros2", "cyclonedds", "ros2") from error
        return FleetWorld(scenario, stations, Ros2Transport(fleet.network, stations))
    from safenav.fleet.simulation import SimulationTransport

    FleetWorld.check(scenario)
    simulated = SimulationTransport(scenario, stations, fleet.simulation)
    return FleetWorld(scenario, stations, simulated, clock=lambda: simulated.physics.now)
