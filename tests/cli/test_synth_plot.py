"""``safenav synth --plot`` draws small automata whole and sums up large ones."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from once import SCENARIOS
from safenav.report.picture.svg import text_width
from warm import safenav

SVG = "{http://www.w3.org/2000/svg}"


def _texts(path: Path) -> list[str]:
    return [element.text or "" for element in ElementTree.parse(path).iter(f"{SVG}text")]


@pytest.fixture(scope="module")
def plots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plots")
    for name in ("hello", "corridor_swap"):
        done = safenav("synth", SCENARIOS / f"{name}.yaml", "-o", folder, "--plot")
        assert done.returncode == 0, done.stderr
    return folder


def test_a_small_automaton_is_drawn_state_by_state(plots: Path) -> None:
    nodes = json.loads((plots / "rover.json").read_text())["nodes"]
    texts = _texts(plots / "rover.svg")
    boxes = [text for text in texts if re.fullmatch(r"(\w+ )?\d+ \[\d+, \d+\]", text)]
    assert len(boxes) == len(nodes)
    assert boxes[0] == "17 [2, 3]"
    assert (
        f"{len(nodes)} states, {sum(len(n['trans']) for n in nodes.values())} transitions" in texts
    )
    assert {"heads for west", "heads for east"} <= set(texts)


def test_a_large_one_is_summed_up_on_the_map(plots: Path) -> None:
    nodes = json.loads((plots / "a.json").read_text())["nodes"]
    root = ElementTree.parse(plots / "a.svg")
    counts = [
        int(element.text or "")
        for group in root.findall(f"{SVG}g")
        for element in group.findall(f"{SVG}text")
        if element.get("font-weight") == "bold"
    ]
    assert sum(counts) == len(nodes)
    words = " ".join(_texts(plots / "a.svg"))
    assert f"{len(nodes)} states" in words and "tracks b" in words
    assert "assumes: infinitely often no robot is beside it" in words


def test_no_text_of_a_plot_leaves_the_page(plots: Path) -> None:
    for path in plots.glob("*.svg"):
        root = ElementTree.parse(path).getroot()
        for element in root.findall(f"{SVG}text"):
            size, bold = float(element.attrib["font-size"]), "font-weight" in element.attrib
            right = float(element.attrib["x"]) + text_width(element.text or "", size, bold)
            assert right <= float(root.attrib["width"]), element.text


def test_a_plot_needs_a_directory() -> None:
    done = safenav("synth", SCENARIOS / "hello.yaml", "--plot")
    assert done.returncode == 2
    assert "name a directory with -o" in done.stderr


def test_without_the_option_nothing_is_drawn(tmp_path: Path) -> None:
    safenav("synth", SCENARIOS / "hello.yaml", "-o", tmp_path)
    assert [*tmp_path.glob("*.dot")] and not [*tmp_path.glob("*.svg")]
