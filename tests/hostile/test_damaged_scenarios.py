"""Damaged scenarios through the commands: a result or a message with a position, and never exit 4,
a traceback or a hang."""

import copy
import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import event, given
from hypothesis import strategies as st

import warm
from scenario.mistakes import places
from support.examples import campaign
from support.missions import mission

pytestmark = pytest.mark.slow

VALUES = st.sampled_from(
    [
        *(None, True, -1, 0, 3, 10**12, 0.5, float("nan"), "", "x", "r0", "region", "hold", "é"),
        *([], {}, [0], [1, 1], [[7]], {"any": []}, {"hold": 8}),
        *("next(region)", "region' = 99", "1...2", "!!python/none"),
    ]
)


@st.composite
def damaged(draw: st.DrawFn) -> dict[str, Any]:
    """A valid scenario with one to three values replaced, removed, or put somewhere else. No
    robot tracks another: that makes strategies of 20,000 states, which ask nothing more of the
    readers."""
    data = mission("tracked", draw(st.integers(0, 10**6)))
    for robot in data["robots"].values():
        robot.pop("tracks", None)
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3]))):
        kind = draw(st.sampled_from(["replace", "replace", "remove", "rename"]))
        place = draw(st.sampled_from([*places(data)]))
        holder: Any = data
        for key in place[:-1]:
            holder = holder[key]
        if kind == "replace":
            holder[place[-1]] = copy.deepcopy(draw(VALUES))
        elif kind == "remove":
            del holder[place[-1]]
        elif isinstance(holder, dict):
            holder[str(draw(VALUES))] = holder.pop(place[-1])
    return data


@campaign(150)
@given(damaged(), st.sampled_from(["check", "run", "explain"]))
def test_every_command_gives_a_result_or_a_message_for_a_damaged_scenario(
    data: dict[str, Any], command: str
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "damaged ü.yaml"
        file.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        options = ["--max-ticks", "30", "--no-map"] if command == "run" else []
        done = warm.safenav(command, file, *options)
    event(f"{command}: {done.returncode}")
    assert done.returncode in (0, 1, 2, 3) and "Traceback" not in done.stderr, done.stderr
    assert done.returncode != 2 or file.name in done.stderr, done.stderr
