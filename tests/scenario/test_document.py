"""YAML as a tree of nodes with places: the core schema, limits, hostile input."""

import math

import pytest

from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import (
    DocumentError,
    Mapping,
    Place,
    read_document,
    scalar_value,
)


@pytest.fixture(params=["C", "Python"], autouse=True)
def _both_yaml_parsers(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Installations without libyaml fall back to PyYAML's own parser."""
    import yaml

    if request.param == "Python":
        monkeypatch.setattr(document, "_LOADER", yaml.SafeLoader)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("47", 47),
        ("-3", -3),
        ("012", 12),
        ("0x1F", 31),
        ("0o17", 15),
        ("1.5", 1.5),
        ("1e3", 1000.0),
        ("-.inf", -math.inf),
        ("true", True),
        ("False", False),
        ("no", "no"),
        ("on", "on"),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("~", None),
        ("", None),
        ("9" * 5000, "9" * 5000),
        ("\u0663", "\u0663"),
    ],
)
def test_plain_scalars_follow_the_core_schema(text: str, value: object) -> None:
    assert scalar_value(text) == value
    assert type(scalar_value(text)) is type(value)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("", (1, 1), "the file is empty"),
        ("# only a comment\n", (1, 1), "the file is empty"),
        ("a: [1, 2", None, "not YAML"),
        ('a: "b', None, "not YAML"),
        ("a: b: c", (1, 5), "not YAML: .*mapping values"),
        ("a: !!python/object/apply:os.system [x]", (1, 4), "the tag !!python"),
        ("a: !local 3", (1, 4), "the tag !local"),
        ("a: [!owed, c]", (1, 5), "the tag !owed"),
        ("a: *nothing", (1, 4), None),
        ("a: &a [*a]", (1, 8), None),
        ("a: 1\n---\nb: 2", (2, 1), "a second document"),
        ("a: \x00", (1, 4), "not text: .*U\\+0000"),
        ("b: 1\na: \ud800", (2, 4), None),
    ],
)
def test_unusable_text_is_refused_with_a_position(
    text: str, place: tuple[int, int] | None, words: str | None
) -> None:
    with pytest.raises(DocumentError, match=words) as caught:
        read_document(text)
    if place is not None:
        assert caught.value.place == Place(*place)


@pytest.mark.parametrize(
    "text",
    ["[" * 100_000, "{a: " * 100_000, "- " * 5_000 + "x", "a: " + "[" * 60 + "]" * 60],
    ids=["lists", "mappings", "blocks", "closed"],
)
def test_deep_nesting_is_refused(text: str) -> None:
    with pytest.raises(DocumentError, match="nested more than 50 deep"):
        read_document(text)


def test_aliases_cannot_explode() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    for i in range(1, 30):
        lines.append(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]")
    with pytest.raises(DocumentError, match="more than 100000 values") as caught:
        read_document("\n".join(lines))
    assert "aliases" in caught.value.hint


def test_errors_in_keys_do_not_hide_the_rest() -> None:
    found = read_document("a: 1\na: 2\n3: x\n[b]: y\ntrue: z\nc: 4")
    assert isinstance(found.root, Mapping)
    assert [key.text for key, _ in found.root.entries] == ["a", "c"]
    assert [(place.line, flaw) for place, flaw, _ in found.flaws] == [
        (2, "duplicate key 'a'"),
        (3, "the key 3 is not a word"),
        (4, "a key is a list or a mapping"),
        (5, "the key true is not a word"),
    ]
