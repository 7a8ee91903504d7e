"""The process of a live run: it steps a mission on request and writes its trace.

In a separate process, a synthesis blocks no page and the run can be stopped at any moment: SIGINT
ends it at the next opportunity, as in ``safenav run``.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Mapping, Sequence
from typing import IO, Any

from msgspec.structs import replace

from safenav.errors import SafenavError, UsageError
from safenav.lines import line_output
from safenav.runtime.analysis.resuming import joins_words, rest_with
from safenav.runtime.intervention.reading import intervention
from safenav.runtime.mission import Mission
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.studio.run.orders import ADD, DONE, FAILED, REFUSED, RunOrder
from safenav.trace.records import Record
from safenav.trace.writing import as_data


def main() -> None:
    """Serve one run over standard input and output."""
    say = line_output()
    try:
        _serve(sys.stdin, say)
    except SafenavError as error:
        say({"type": FAILED, "message": str(error)})
    except BrokenPipeError:
        os._exit(1)  # the server has ended
    except Exception as error:
        say({"type": FAILED, "message": f"internal error: {type(error).__name__}: {error}"})
        raise


def _serve(orders: IO[str], say: Any) -> None:
    order = RunOrder.read(orders.readline())
    scenario = load_scenario_text(order.text, order.file, reach=order.reach)
    if order.seed is not None:
        scenario = replace(scenario, seed=order.seed)
    if order.clock is not None:
        scenario = replace(scenario, clock=Clock(order.clock))

    records: list[Record] = []

    def tell(record: Record) -> None:
        records.append(record)
        say(as_data(record))

    mission = Mission(scenario, listeners=[tell], attended=True)

    def interrupt(*_: object) -> None:
        if mission.stopping:
            raise KeyboardInterrupt
        mission.stop("ended by the user")

    signal.signal(signal.SIGINT, interrupt)
    mission.start()
    say({"type": DONE, "tick": 0})
    changed = False
    while mission.result is None:
        rested = time.monotonic()
        line = orders.readline()
        mission.exclude_idle_time(time.monotonic() - rested)
        if not line:
            break
        data = json.loads(line)
        if data["do"] == "step":
            mission.step()
            changed = False
            say({"type": DONE, "tick": mission.state.tick})
        elif data["do"] == "change":
            try:
                if data.get("kind") == ADD:
                    if changed:  # earlier changes take effect first
                        mission.step()
                    rest = _rest(mission, records, data)
                    records.clear()
                    mission = Mission(rest, listeners=[tell], attended=True)
                    mission.start()
                    changed = False
                    say({"type": DONE, "tick": 0})
                else:
                    mission.intervene(intervention(data, mission.scenario))
                    changed = True
            except UsageError as error:
                say({"type": REFUSED, "message": str(error)})
        else:
            mission.give_up("ended by the user")
            say({"type": DONE, "tick": mission.state.tick})


def _rest(mission: Mission, records: Sequence[Record], data: Mapping[str, Any]) -> Scenario:
    """End a run that a robot joins, and return the scenario of the rest with that robot. Raises
    UsageError."""
    if mission.result is not None:
        raise UsageError("the run has ended: no robot can join it")
    name, item = str(data.get("robot")), data.get("item")
    rest = rest_with(records, mission.scenario, json.dumps({name: item}))
    mission.give_up(joins_words(rest))
    return rest


if __name__ == "__main__":
    main()
