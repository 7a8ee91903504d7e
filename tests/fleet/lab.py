"""``python lab.py SCENARIO FLEET PACE``: the physics simulation of a scenario, for other processes.

It prints the port of a manager whose ``lab()`` is a ``Physics``, and ends with its standard input.
"""

import sys
import threading
import time
from multiprocessing.managers import BaseManager
from pathlib import Path
from typing import Any

KEY = b"lab"
COMMANDS = ("send", "stop", "perform", "state", "scan", "noticed", "step")
PART = 0.1
"""Simulated seconds between two looks at the clock where time goes faster: two milliseconds."""
IDLE = 5
"""How much slower time passes while no robot moves: half of a drive, for the processor."""


def watched(physics: Any) -> Any:
    """The same physics with ``contacts``: the steps of each pair that touched, as names of robots,
    ``wall`` and obstacles; ``moving``: its robots under way; and ``log``. Several threads may call
    it."""
    physics.contacts, step, lock = {}, physics._step, threading.RLock()

    def locked(call: Any) -> Any:
        def alone(*arguments: Any) -> Any:
            with lock:
                return call(*arguments)

        return alone

    def named(geom: int) -> str:
        return str(physics._model.geom(geom).name).split(".")[0].split("~")[0]

    def noted() -> None:
        step()
        for index in range(physics._data.ncon):
            pair = tuple(sorted(named(int(g)) for g in physics._data.contact[index].geom))
            if {*pair} & {*physics._bodies}:
                physics.contacts[pair] = physics.contacts.get(pair, 0) + 1

    def moving() -> list[str]:
        return sorted(name for name in physics._bodies if physics._moves(name))

    def log() -> dict[str, Any]:
        places = {n: physics._at(body)[:2] for n, body in physics._bodies.items()}
        return {
            "now": physics.now,
            "contacts": {" ".join(pair): count for pair, count in physics.contacts.items()},
            "standing": sorted(physics.standing),
            "regions": {n: physics._places.region(*at) for n, at in places.items()},
            "moving": moving(),
        }

    physics._step, physics.moving, physics.log = noted, moving, log
    for call in (*COMMANDS, "moving", "log"):
        setattr(physics, call, locked(getattr(physics, call)))
    return physics


class Access(BaseManager):
    """A lab in another process."""


def lab_at(port: int) -> Any:
    """The lab that listens at a port."""
    Access.register("lab")
    access = Access(("127.0.0.1", port), authkey=KEY)
    access.connect()
    return access.lab()  # type: ignore[attr-defined]


def ends() -> threading.Event:
    """Set when standard input ends."""
    end = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), end.set()), daemon=True).start()
    return end


def main(scenario: Path, fleet: Path, pace: float) -> None:
    from safenav.fleet.file import load_fleet
    from safenav.fleet.lab.simulation import SimulationTransport
    from safenav.scenario.reading.loader import load_scenario

    plan = load_scenario(scenario)
    given = load_fleet(fleet, plan)
    lab = watched(SimulationTransport(plan, given.stations, given.simulation).physics)
    Access.register("lab", callable=lambda: lab)
    server = Access(("127.0.0.1", 0), authkey=KEY).get_server()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    end = ends()
    print(server.address[1], flush=True)
    while not end.is_set() and not lab.moving():  # at the pace of a clock until then
        lab.step(0.02)
        end.wait(0.02)
    due = time.monotonic()
    while not end.is_set():
        if (ahead := due - time.monotonic()) > 0:
            end.wait(ahead)
        else:
            time.sleep(0)  # others get the lock
        lab.step(PART)
        slower = 1 if lab.moving() else IDLE
        due = max(due, time.monotonic()) + slower * PART / pace


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]))
