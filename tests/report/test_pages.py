"""Pages as files: built from these sources, small and self-contained, with data that nothing breaks
out of; in three dimensions on the clock of the motion."""

import hashlib
import json
import re
import shutil
import zlib
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from children import ran
from report.runs import page_of, run_of, solid_page_of, trace_of
from safenav import motion_of, read_trace
from safenav.motion.columns import columns_of
from safenav.motion.file import GoalLine, Measured
from safenav.motion.timing import in_time
from safenav.report.page.html import embedded, encoded
from safenav.report.page.motion import RATE, encoded_motion
from safenav.trace import records

PAGE = Path(__file__).parents[2] / "safenav" / "report" / "page"
FRONT = PAGE / "front"


@pytest.mark.parametrize("built", sorted((PAGE / "assets").iterdir()), ids=lambda path: path.name)
def test_the_bundle_was_built_from_these_sources(built: Path) -> None:
    """Fails when sources changed without `npm run build` in safenav/report/page/front."""
    digest = hashlib.sha256()
    files = [path for path in (FRONT / "src").rglob("*") if path.is_file()]
    sources = sorted(path.relative_to(FRONT).as_posix() for path in files)
    for source in [*sources, "build.mjs", "package-lock.json", "tsconfig.json"]:
        digest.update(f"{source}\n".encode() + (FRONT / source).read_bytes())
    stamp = built.read_text().splitlines()[0]
    assert stamp == f"/* sources {digest.hexdigest()} */"


@pytest.mark.parametrize("check", ["build.mjs --check", "node_modules/.bin/tsc --noEmit"])
def test_a_rebuild_gives_the_same_bytes_and_types_are_right(check: str) -> None:
    node = shutil.which("node")
    if node is None or not (FRONT / "node_modules").exists():
        pytest.skip("needs Node and `npm ci` in safenav/report/page/front")
    done = ran([node, *check.split()], cwd=FRONT)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("solid", [False, True], ids=["flat", "3D"])
def test_a_page_is_small_and_names_no_other_file(solid: bool) -> None:
    page = solid_page_of("door") if solid else page_of("door").read_text()
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]
    assert "default-src 'none'" in page
    assert len(page.encode()) <= (400_000 if solid else 130_000)


def test_a_set_of_regions_is_written_once() -> None:
    """With beliefs, pages of long runs took many megabytes."""
    data = encoded(run_of("meeting"), "x.jsonl")
    changes = [change for robot in data["robots"] for change in robot["sight"]]
    assert len(changes) > len(data["sets"]) == len({*data["sets"]}) > 1


def test_embedded_data_survives_and_cannot_end_its_element() -> None:
    data = {"text": "</script><!-- \u2028 & > é", "number": [1, None, True]}
    text = embedded(data)
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == data


def test_in_3d_an_order_appears_with_its_request() -> None:
    """It appeared at the start if no robot had been in its region."""
    trace = read_trace(trace_of("loads"))
    lines = in_time(trace, motion_of(trace)).records
    ordered = {one.obstacle: one.t for one in lines if isinstance(one, records.Appeared)}
    asked = [one for one in lines if isinstance(one, records.Request) and one.obstacle in ordered]
    first = {one.obstacle: one.t for one in reversed(asked)}
    assert first == ordered and all(ordered.values())


def test_in_3d_a_run_in_lockstep_has_the_charges_of_its_ticks() -> None:
    (data,) = re.findall(r'id="run">(.*?)</script>', solid_page_of("charges"))
    charge = [level for _, level in json.loads(data)["robots"][0]["charge"]]
    ticked = run_of("charges").track("cart").charge
    assert ticked is not None
    # Charging takes no time in such a motion: of what happens in one instant, the last is shown.
    assert charge[-1] == ticked.now > 0
    assert set(charge) <= {level for _, level in ticked}


def unpacked(packed: dict[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
    """The columns of packed data, in metres and radians."""
    table = np.array(json.loads(zlib.decompress(b64decode(packed["data"])))).cumsum(axis=1) / 1000
    return dict(zip(packed["columns"], table, strict=True))


def test_a_body_is_where_it_was_measured_and_its_ghost_where_the_plan_is() -> None:
    """Every measurement is moved to the east."""
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    from fleet.lab import driven

    motion, east = driven(goals=("spot",)).motion, 0.6
    lines = [
        replace(line, rows=tuple(replace(row, x=row.x + east) for row in line.rows))
        if isinstance(line, Measured)
        else line
        for line in motion.lines
    ]
    data = encoded_motion(replace(motion, lines=tuple(lines)))
    for track, name in zip(data["tracks"], motion.header.robots, strict=True):
        body, ghost = unpacked(track), unpacked(track["ghost"])
        if name == "spot":  # its ghost stands at the goal that it has
            goals = [line for line in motion.lines if isinstance(line, GoalLine)]
            index = int(RATE * (goals[-1].t0 + 0.2))
            assert abs(ghost["x"][index] - goals[-1].x) < 2e-3
            continue
        planned = columns_of(motion, name, RATE, in_world=False, planned=True).place[0]
        assert np.abs(ghost["x"] - planned).max() < 2e-3
        assert np.abs(body["x"] - ghost["x"] - east).max() < 0.1
        if name == "digit":
            for foot in ("lx", "rx"):  # the whole body is moved
                assert np.abs(body[foot] - ghost[foot] - (body["x"] - ghost["x"])).max() < 3e-3
