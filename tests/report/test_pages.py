"""Pages as files: built from these sources, small and self-contained, with data that nothing breaks
out of; in three dimensions on the clock of the motion."""

import hashlib
import json
import re
import shutil
import zlib
from base64 import b64decode
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from children import ran
from report.runs import changed, data_of, page_of, paged, run_of, trace_of
from safenav import motion_of, read_trace
from safenav.motion.columns import columns_at, times_of
from safenav.motion.file import Segment
from safenav.report.picture.svg import obstacle_pictogram
from safenav.scenario.reading.catalogue import built_in

PAGE = Path(__file__).parents[2] / "safenav" / "report" / "page"
FRONT = PAGE / "front"


@pytest.mark.parametrize("built", sorted((PAGE / "assets").iterdir()), ids=lambda path: path.name)
def test_the_page_assets_were_built_from_these_sources(built: Path) -> None:
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


@pytest.mark.parametrize("solid", [(), ("--3d",)], ids=["flat", "3D"])
def test_a_page_is_small_and_names_no_other_file(solid: tuple[str, ...]) -> None:
    page = page_of("door", *solid).read_text()
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]
    assert "default-src 'none'" in page
    assert len(page.encode()) <= (400_000 if solid else 130_000)


def test_a_page_stores_each_set_of_regions_once() -> None:
    """With beliefs, pages of long runs would take many megabytes."""
    data = data_of(page_of("meeting"))
    told = [held for robot in data["robots"] for held in robot["beliefs"].values()]
    assert len([*chain(*told)]) > len(data["sets"]) == len({*data["sets"]}) > 1


def test_every_obstacle_has_a_silhouette_even_under_a_longer_name() -> None:
    for name in built_in().obstacles:
        own, *longer = map(obstacle_pictogram, (name, f"my_{name}", f"my-{name}"))
        assert longer == [own, own] and own
    assert not obstacle_pictogram("trapdoor")
    assert obstacle_pictogram("my_door") != obstacle_pictogram("my_pulled_door")


def test_embedded_data_is_unchanged_and_cannot_end_its_script_element(tmp_path: Path) -> None:
    evil = "</script><!-- & > é \u2028"
    trace = changed("door", [{"line": 1, "fields": {"scenario.name": evil}}], tmp_path)
    page = paged(trace, tmp_path)
    assert data_of(page)["name"] == evil.replace("\u2028", "\\u2028"), "as its escape"
    (text,) = re.findall('id="run">(.*?)</script>', page.read_text())
    assert not set("<>&") & set(text)


def test_in_3d_an_order_appears_with_its_request() -> None:
    """Not at the start, even if no robot has been in its region."""
    data = data_of(page_of("loads", "--3d"))
    asked = {e[4]: e[0] for e in reversed(data["events"]) if e[1] == "request"}
    orders = {one["region"]: one["status"][1][0] for one in data["obstacles"] if one["ordered"]}
    assert orders == {region: asked[region] for region in orders} and all(orders.values())


def test_in_3d_a_wait_for_a_change_states_its_time_in_seconds() -> None:
    """The words are not those of a live run with the number of the tick."""
    data = data_of(page_of("shut", "--3d"))
    events = {kind: (data["times"][tick], text) for tick, kind, text, *_ in data["events"]}
    assert f"change of the scenario at {events['gone'][0]:.1f} s" in events["paused"][1]


def test_in_3d_a_battery_is_empty_before_it_is_replaced() -> None:
    """It must not be shown as full before another robot has replaced it."""
    robots, track = data_of(page_of("battery", "--3d"))["robots"], run_of("battery").track("digit")
    (levels,) = ([level for _, level in each["charge"]] for each in robots if each["charge"])
    assert levels == [level for _, level in track.charge] and {0, 100} < {*levels}


def test_in_3d_a_body_and_its_feet_are_where_the_motion_has_them() -> None:
    motion = motion_of(read_trace(trace_of("door")))
    for name, track in zip(
        motion.header.robots, data_of(page_of("door", "--3d"), "motion")["tracks"], strict=True
    ):
        table = (
            np.array(json.loads(zlib.decompress(b64decode(track["data"])))).cumsum(axis=1) / 1000
        )
        found, planned = (
            dict(zip(track["columns"], table, strict=True)),
            columns_at(motion, name, times_of(motion, 20)),
        )
        feet = {"lx": "left_x", "ry": "right_y"} if track["kind"] == "walker" else {}
        for short, column in ({"x": "x", "y": "y", "z": "z"} | feet).items():
            assert np.abs(found[short] - planned[column]).max() < 1e-3
        for step in motion.of(Segment, name)[:1]:
            begun = [[round(1000 * foot.x), round(1000 * foot.y)] for foot in step.feet[:2]]
            assert sorted(prints[:2] for prints in track["feet"][:2]) == sorted(begun)
