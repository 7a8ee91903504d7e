"""Files of other tools are named for what they are, with what to do; maps are read as those tools
read them."""

from pathlib import Path

import pytest

from cli.conftest import Command

WHITE = "P2\n2 2\n255\n255 255\n255 255\n"
ROS = {
    "image": "m.pgm",
    "resolution": "0.05",
    "origin": "[0, 0, 0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}

FOREIGN = {
    "rmf": (
        "run office.building.yaml",
        "levels:\n  L1:\n    vertices:\n      - [100.0, 200.0, 0, p1]\nname: building\n",
        "this is a building file of RMF",
        "safenav new FILE --map",
    ),
    "movingai": (
        "run r.map",
        "type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n",
        "this is a map of the MovingAI benchmarks",
        "safenav draw r.map",
    ),
    "tlsf": (
        "synth a.tlsf",
        'INFO {\n  TITLE: "x"\n}\nMAIN {\n  INPUTS { r; }\n}\n',
        "this is a specification in TLSF",
        "syfco -f slugs a.tlsf",
    ),
    "gr1c": (
        "synth a.spc",
        "ENV: x;\nSYS: y;\nENVGOAL: []<> x;\n",
        "this is a specification of gr1c",
        "[SYS_TRANS]",
    ),
    "ros": (
        "run m.yaml",
        "".join(f"{key}: {value}\n" for key, value in ROS.items()),
        "this is a map of ROS map_server",
        "safenav draw m.yaml",
    ),
}


@pytest.mark.parametrize(("command", "text", "found", "hint"), FOREIGN.values(), ids=FOREIGN)
def test_a_file_of_another_tool_is_named(
    command: str, text: str, found: str, hint: str, safenav: Command, tmp_path: Path
) -> None:
    action, name = command.split()
    (tmp_path / name).write_text(text)
    refused = safenav(action, name)
    assert refused.returncode == 2
    assert found in refused.stderr
    assert hint in refused.stderr


BROKEN = {
    "terrain": ("h.map", "type octile\nheight 1\nwidth 3\nmap\n.#.\n", "known: . @ E G"),
    "width": ("w.map", "type octile\nheight 1\nwidth 5\nmap\n....\n", "check 'width'"),
    "unit": ("m.yaml", {"resolution": "5cm"}, "found the text '5cm'"),
    "missing": ("m.yaml", {"occupied_thresh": None}, "the key 'occupied_thresh' is missing"),
    "yaw": ("m.yaml", {"origin": "[0.0, 0.0, -nan]"}, "write 0: map_saver writes nan"),
}


@pytest.mark.parametrize(("name", "change", "words"), BROKEN.values(), ids=BROKEN)
@pytest.mark.parametrize("side", [[], ["--side", "0.05"]], ids=["undivided", "divided"])
def test_the_hint_of_a_map_error_is_about_that_error(
    name: str,
    change: str | dict[str, str | None],
    words: str,
    side: list[str],
    safenav: Command,
    tmp_path: Path,
) -> None:
    text = change if isinstance(change, str) else ros_map(change)
    (tmp_path / name).write_text(text)
    (tmp_path / "m.pgm").write_text(WHITE)
    refused = safenav("draw", name, *side if name == "m.yaml" else ())
    assert refused.returncode == 2
    assert words in refused.stderr
    assert "give the size of the regions" not in refused.stderr


def test_a_map_without_a_size_of_regions_asks_for_it(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(ros_map({}))
    (tmp_path / "m.pgm").write_text(WHITE)
    asked = safenav("draw", "m.yaml")
    assert asked.returncode == 2
    assert "give the size of the regions: --rows 20" in asked.stderr


ACCEPTED = {
    "thresholds of Nav2's speed maps": {"free_thresh": "0.0", "occupied_thresh": "1.0"},
    "mode scale": {"mode": "scale"},
}


@pytest.mark.parametrize("change", ACCEPTED.values(), ids=ACCEPTED)
@pytest.mark.parametrize("indent", ["", "  "], ids=["flush", "indented"])
def test_white_pixels_of_a_ros_map_are_free(
    change: dict[str, str | None], indent: str, safenav: Command, tmp_path: Path
) -> None:
    (tmp_path / "m.yaml").write_text(ros_map(change, indent))
    (tmp_path / "m.pgm").write_text(WHITE)
    drawn = safenav("draw", "m.yaml", "--side", "0.05")
    assert drawn.returncode == 0, drawn.stderr
    assert "█" not in drawn.stdout


def test_emitters_and_service_points_are_free(safenav: Command, tmp_path: Path) -> None:
    rows = "@.....@\nE.@@@.S\n@.....@\n"
    (tmp_path / "lorr.map").write_text(f"type octile\nheight 3\nwidth 7\nmap\n{rows}")
    drawn = safenav("draw", "lorr.map")
    assert drawn.returncode == 0, drawn.stderr
    for region in (7, 13):
        assert str(region) in drawn.stdout.split()


def ros_map(change: dict[str, str | None], indent: str = "") -> str:
    keys = {key: value for key, value in {**ROS, **change}.items() if value is not None}
    return "".join(f"{indent}{key}: {value}\n" for key, value in keys.items())


CONTRADICTIONS = {
    "clocks": (["run", "s.yaml", "--clock", "live", "--lockstep"], "contradict each other"),
    "two files": (["new", "--schema", "--fleet", "s.yaml"], "give one of --template"),
    "a motion twice": (["export", "t.jsonl", "m.jsonl", "--motion", "n.jsonl"], "give one of them"),
    "rows without a map": (["new", "--rows", "3"], "go with --map"),
    "gusts without a motion": (["export", "t.jsonl", "-o", "w.csv", "--gust", "1"], "--motion"),
    "a robot without columns": (["export", "t.jsonl", "-o", "w.csv", "--robot", "a"], "--columns"),
    "two prints": (["synth", "s.yaml", "--json", "-o", "-"], "both print"),
}


@pytest.mark.parametrize(("arguments", "words"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_options_that_contradict_each_other_are_refused(
    arguments: list[str], words: str, safenav: Command
) -> None:
    safenav("new", "s.yaml")
    refused = safenav(*arguments)
    assert refused.returncode == 2
    assert words in refused.stderr


def test_a_missing_file_is_not_confused_with_one_that_shares_its_suffix(
    safenav: Command, tmp_path: Path
) -> None:
    (tmp_path / "bin.yaml").write_text("")
    assert "did you mean" not in safenav("check", "missing.yaml").stderr
    (tmp_path / "missings.yaml").write_text("")
    assert "did you mean 'missings.yaml'" in safenav("check", "missing.yaml").stderr


@pytest.mark.parametrize("name", ["move", "wait", "assigned", "busy_north", "at_other", "goal"])
def test_memory_named_like_a_variable_of_specifications_is_refused_at_its_place(
    name: str, safenav: Command, tmp_path: Path
) -> None:
    objective = f"{{ltl: {{memory: {{{name}: bool}}, liveness: region = 2}}}}"
    (tmp_path / "s.yaml").write_text(
        "safenav: 1\nmap: {grid: ['...']}\nrobots:\n"
        f"  a: {{model: quadcopter, start: 0, objective: {objective}}}\n"
    )
    refused = safenav("check", "s.yaml")
    assert refused.returncode == 2
    assert f"s.yaml:4:63: '{name}' is reserved" in refused.stderr
