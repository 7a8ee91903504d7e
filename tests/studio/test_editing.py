"""An edit of the drawing changes only its own part of the text."""

import difflib
import os
import random
from collections.abc import Iterator
from typing import Any

import pytest

from once import SCENARIOS, beside, from_yaml
from report.runs import own
from safenav import InputError, load_scenario_text
from studio.serving import Page, Served

DOOR = (SCENARIOS / "case_study_1.yaml").read_text()
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 25 or 6
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))


TABLE = from_yaml(beside(__file__, "edits.yaml"))
COMMENTED = TABLE["texts"]["commented"]
TEXTS = {
    "door": DOOR,
    **TABLE["texts"],
    "listed": COMMENTED.replace(
        "patrol: [12, 15]  # in turn", "patrol:\n      - 12  # the bed\n      - 15  # the hall"
    ),
    "areas": DOOR.replace(
        "robots:",
        "areas: {hall: {rows: 1-2, columns: 3}, spots: [[1, 1], {columns: 1-2}]}\nrobots:",
    ).replace("[54, 49]", "[hall, spots]"),
    "timed": DOOR.replace("{patrol: [58, 28]}", "{patrol: [58, 28], within: 40}")
    + "chargers: [14]\nlate: go_on\nresolve_within: 30\n",
}
SMALL = 'safenav: 1\nmap:\n  grid: ["###", \'#.#\', "###"]\n'


class Desk:
    """The drawing board of a studio: ``shown`` is what a page shows now."""

    def __init__(self, page: Page) -> None:
        self.page, self.shown = page, page.document("")

    @property
    def text(self) -> str:
        return str(self.shown["text"])

    def write(self, text: str) -> None:
        self.page.say("text", text=text)
        self._look(text)

    def edit(self, operation: dict[str, Any]) -> str | None:
        """Edit the text; return the words that refuse it, if it is impossible."""
        refused = self.page.say("edit", **operation)
        self._look(self.page.get("save/scenario").decode())
        return refused

    def _look(self, text: str) -> None:
        if text != self.text:
            self.shown = self.page.hear(lambda m: m["is"] == "document" and m["text"] == text)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    place = tmp_path_factory.mktemp("desk")
    with Served("studio", "--no-browser", cwd=place) as served, served.opened() as page:
        yield Desk(page)


@pytest.mark.parametrize("case", TABLE["edits"], ids=str)
def test_an_edit_changes_only_its_lines(case: dict[str, Any], desk: Desk) -> None:
    """Comments, quotes and spaces of all others stay; an impossible edit is refused."""
    text = TEXTS.get(case["text"], SMALL + case["text"])
    desk.write(text)
    assert desk.edit(case["edit"]) == case.get("refused")
    told = [*difflib.unified_diff(text.splitlines(), desk.text.splitlines(), n=0, lineterm="")][2:]
    changed = [line for line in told if line[0] != "@"]
    assert changed == case.get("lines", "").splitlines()


def something(drawing: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """An edit of a drawing, sensible or not."""
    size = drawing["run"]["rows"] * drawing["run"]["cols"]
    regions = [chance.randrange(size) for _ in range(2)]
    robot = chance.choice([each["name"] for each in drawing["robots"]] or ["nobody"])
    obstacle = {"index": chance.randrange(len(drawing["obstacles"]) + 1)}
    kind = chance.choice(("patrol", "visit", "cover", "hold"))
    edits: list[tuple[str, dict[str, Any]]] = [
        ("paint", {"regions": regions, "wall": chance.random() < 0.4}),
        ("add_robot", {"model": "digit", "heading": "east"}),
        ("add_robot", {"model": "quadcopter"}),
        ("move_robot", {"robot": robot}),
        ("set_objective", {"robot": robot, "kind": kind, "regions": regions}),
        ("set_objective", {"robot": robot, "kind": kind, "regions": ["a1", regions]}),
        ("remove_robot", {"robot": robot}),
        ("add_obstacle", {"type": "door"}),
        ("add_obstacle", {"type": "uncertainty", "from": 3}),
        ("move_obstacle", obstacle),
        ("remove_obstacle", obstacle),
    ]
    op, more = chance.choice(edits)
    return {"op": op, "region": chance.randrange(size), **more}


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEQUENCES))
def test_random_edits_leave_a_valid_or_diagnosed_text(seed: int, desk: Desk) -> None:
    """Mistakes are diagnostics, never exceptions, and a drawing never loses its map."""
    chance = random.Random(seed)
    desk.page.say("open", kind="blank")
    desk.shown = desk.page.document("name: new scenario")
    if seed % 2 == 0:
        desk.write(DOOR[: DOOR.index("expect:")])
    for _ in range(30):
        refused = desk.edit(something(desk.shown["drawing"], chance))
        assert refused is None or refused
    try:
        load_scenario_text(desk.text)
    except InputError as error:
        assert error.diagnostics
    else:
        assert not desk.shown["problems"]


def test_comments_stay_through_many_edits_of_the_map(desk: Desk) -> None:
    chance = random.Random(5)
    desk.write(COMMENTED)
    for _ in range(80):
        edit = something(desk.shown["drawing"], chance)
        if not edit["op"].startswith("remove"):
            desk.edit(edit)
    comments = [line.partition("# ")[2] for line in COMMENTED.splitlines() if "# " in line]
    assert len(comments) == 15
    assert all(f"# {comment}" in desk.text for comment in comments), desk.text
    assert desk.shown["drawing"]["run"]["name"] == "commented"


def test_areas_orders_and_exclusions_are_drawn(desk: Desk) -> None:
    desk.write(TEXTS["areas"])
    drawing = desk.shown["drawing"]
    assert drawing["robots"][0]["targets"][0] == [16, 29]
    assert drawing["run"]["areas"]["hall"] == [16, 29]
    desk.write(own("zone"))
    still = desk.shown["drawing"]["run"]
    assert still["exclusions"] == [[["a", "b"], [8, 9]]]
    assert (still["obstacles"][0]["type"], still["obstacles"][0]["ordered"]) == ("parcel", True)
    assert still["robots"][0]["tasks"][0][2:] == [[8], [10]]  # targets, and regions to avoid
