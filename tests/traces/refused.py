"""Lines that no trace may have (``refused.yaml``, and large ones), and files that are not a trace.
The reader refuses them (``test_reader``), and so does the judge (``judge.test_parts``)."""

from pathlib import Path

from once import from_yaml
from support.damage import GOOD, Edit, text

REFUSED = from_yaml(Path(__file__).with_name("refused.yaml").read_text())
DOOR = text(GOOD["door"]())
HEADER = DOOR[0]


def of_header(who: str, words: str, path: str, value: object) -> tuple[str, str, str, list[Edit]]:
    return who, "door", words, [{"line": ["header"], "fields": {path: value}}]


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
MANY = [GOOD["door"]()[0]["scenario"]["robots"][0] | {"name": f"r{k}"} for k in range(1001)]
ALWAYS = "scenario.robots.0.objective.always"
CASES = [
    *(
        (who, name, words, edits)
        for who, traces in REFUSED.items()
        for name, each in traces.items()
        for words, *edits in each
    ),
    of_header("by both readers", "1001 robots; at most 1000", "scenario.robots", MANY),
    of_header("by both readers", "is nested more than 200 deep", "notes", NESTED),
    of_header("by the judge alone", "too much nesting", ALWAYS, ["(" * 3000]),
    of_header("by the judge alone", "too much nesting", ALWAYS, ["!" * 3000 + "TRUE"]),
    of_header("by the judge alone", "too much nesting", ALWAYS, [" -> ".join(["TRUE"] * 400)]),
]
"""Who refuses it, the good trace, words, and edits; the first edit names the line."""
NOT_TRACES: list[tuple[list[str], int, str]] = [
    ([], 0, "empty"),
    (["", "", ""], 0, "empty"),
    (['{"type": "head'], 0, "the first line is incomplete"),
    (DOOR[1:], 1, "the first line must be the header"),
    ([HEADER, *DOOR], 2, "a second header"),
    ([*DOOR[:6], DOOR[6][:-4], *DOOR[7:]], 7, "not JSON"),
    ([*DOOR[:-1], DOOR[-1][:-4], ""], len(DOOR), "not JSON"),
    ([HEADER, '{"type": "goal", "tick": 1, "tick": 2}', ""], 2, "'tick' appears twice"),
    ([HEADER, '{"type": "goal", "tick": NaN}', ""], 2, "NaN is not a number"),
    ([HEADER, '{"type": "goal", "tick": 1e999}', ""], 2, "is beyond"),
    ([HEADER, '{"tick": 9007199254740993}', ""], 2, "beyond 9007199254740991"),
    ([HEADER, '{"tick": ' + "9" * 6000 + "}", ""], 2, "beyond 9007199254740991"),
    ([HEADER, "[" * 200_000, ""], 2, "nested"),
    (
        [HEADER, '{"type": "gone", "obstacle": "a", "cause": "\\ud800"}'],
        2,
        "half of a character",
    ),
]
"""Lines, the number of the wrong one (0: the whole file), and words."""
