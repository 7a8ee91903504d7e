"""Connection to a fleet by the transport that its file names; transports are loaded on use."""

from __future__ import annotations

from safenav.extras import missing
from safenav.fleet.file.stations import FleetFile, TransportKind
from safenav.fleet.goals import FleetClock, frame_of
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld
from safenav.scenario.model import Scenario


def fleet_world(
    scenario: Scenario, fleet: FleetFile, recording: DriveRecording | None = None
) -> FleetWorld:
    """Return the world, not yet open; ``recording`` takes what is sent and measured.

    Raises UsageError if the transport's library is missing."""
    stations = fleet.stations
    frame_of(scenario)
    if fleet.transport is TransportKind.SIMULATION:
        from safenav.fleet.lab.simulation import SimulationTransport

        simulated = SimulationTransport(scenario, stations, fleet.simulation)
        clock = FleetClock(lambda: simulated.physics.now, simulated.step)
        return FleetWorld(scenario, stations, simulated, clock, recording)
    try:
        from safenav.fleet.ros2.transport import Ros2Transport
    except ImportError as error:
        raise missing("transport ros2", "cyclonedds", "ros2") from error
    transport = Ros2Transport(fleet.network, stations, fleet.inputs)
    return FleetWorld(scenario, stations, transport, recording=recording)
