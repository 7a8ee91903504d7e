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
from typing import IO, Any

from msgspec.structs import replace

from safenav.errors import SafenavError, UsageError
from safenav.lines import line_output
from safenav.runtime.intervention.reading import intervention
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.studio.run.orders import DONE, FAILED, REFUSED, RunOrder
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

    mission = Mission(scenario, listeners=[lambda record: say(as_data(record))], attended=True)

    def interrupt(*_: object) -> None:
        if mission.stopping:
            raise KeyboardInterrupt
        mission.stop("ended by the user")

    signal.signal(signal.SIGINT, interrupt)
    mission.start()
    say({"type": DONE, "tick": 0})
    while mission.result is None:
        rested = time.monotonic()
        line = orders.readline()
        mission.exclude_idle_time(time.monotonic() - rested)
        if not line:
            break
        data = json.loads(line)
        if data["do"] == "step":
            mission.step()
            say({"type": DONE, "tick": mission.tick})
        elif data["do"] == "change":
            try:
                mission.intervene(intervention(data, mission.scenario))
            except UsageError as error:
                say({"type": REFUSED, "message": str(error)})
        else:
            mission.give_up("ended by the user")
            say({"type": DONE, "tick": mission.tick})


if __name__ == "__main__":
    main()
