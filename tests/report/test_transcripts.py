"""What people see of whole runs: the story on the terminal, the data of the page, the words of a
picture. ``make golden`` rewrites the files in ``transcripts/``: review the difference."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from report.runs import TOLD, data_of, page_of, picture_of, run_of, story_of
from support.transcripts import golden

TRANSCRIPTS = Path(__file__).with_name("transcripts")


def _page(name: str) -> Iterator[str]:
    """Yield the data that pages have of each thing, one on a line."""
    data = data_of(page_of(name))
    quiet = {"robots", "obstacles", "events", "marks", "nose", "charger", "version", "grid", "name"}
    for key in sorted(data.keys() - quiet - {"ending"}):
        yield f"{key}: {json.dumps(data[key])}"
    for robot in data["robots"]:
        told = {k: v for k, v in robot.items() if k not in ("look", "shape", "can", "name")}
        yield from (f"{robot['name']} {key}: {json.dumps(told[key])}" for key in sorted(told))
    for obstacle in data["obstacles"]:
        told = {k: v for k, v in obstacle.items() if k not in ("shape", "opened", "name")}
        yield f"{obstacle['name']}: {json.dumps(told)}"
    yield from (json.dumps(event) for event in data["events"])


def _picture(name: str, folder: Path) -> str:
    """Return a picture of the most eventful moment; of loads, while one is carried."""
    run, kinds = run_of(name), ("request", "violation", "plan", "goal")
    ranked = [event.tick for kind in kinds for event in run.told if event.kind == kind]
    at = 20 if name == "loads" else run.time(ranked[0] if ranked else 0)
    return picture_of(name, folder, "--at", str(at)).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", TOLD)
def test_the_story_page_and_picture_of_a_run_stay_the_same(name: str, tmp_path: Path) -> None:
    """The whole picture of some runs shows targets, intentions, names, loads, exclusions, steps
    and the legend: open it to review them."""
    picture = _picture(name, tmp_path)
    texts = ElementTree.fromstring(picture).findall("{http://www.w3.org/2000/svg}text")
    words = [element.text or "" for element in texts]
    lines = [*story_of(name).splitlines(), "", *_page(name), "", *words]
    plain = re.sub(r" in \d[\d.]* (ms|s)\b| in under 1 ms|, from the cache", "", "\n".join(lines))
    plain = re.sub(r"\(.*? summed\), .*? total", "(...)", plain) + "\n"
    golden(plain, TRANSCRIPTS / f"{name}.txt")
    if (drawn := TRANSCRIPTS / f"{name}.svg").exists():
        golden(picture, drawn)
