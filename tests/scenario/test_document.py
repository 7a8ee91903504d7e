"""The reader of YAML documents: its scalars, and its two parsers. All else is seen in scenarios."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from safenav.scenario.yaml import document
from scenario.mistakes import INVALID, VALUES, refuse_as_announced


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
def test_plain_scalars_follow_the_core_schema_of_yaml(text: str, value: object) -> None:
    assert document.scalar_value(text) == value
    assert type(document.scalar_value(text)) is type(value)


@given(VALUES.filter(lambda value: value is not None), st.booleans())
def test_dumped_data_reads_back(value: object, flow: bool) -> None:
    text = yaml.safe_dump(value, default_flow_style=flow, allow_unicode=True)
    assert document.plain(document.read_document(text).root) == value


@pytest.mark.parametrize("text", ["[" * 100_000, "{a: " * 100_000, "- " * 5_000 + "x"])
def test_without_libyaml_the_same_errors_are_reported(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert document._LOADER is yaml.CSafeLoader
    monkeypatch.setattr(document, "_LOADER", yaml.SafeLoader)
    with pytest.raises(document.DocumentError, match="nested more than 50 deep"):
        document.read_document(text)


def test_without_libyaml_an_invalid_scenario_reports_its_listed_errors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(document, "_LOADER", yaml.SafeLoader)
    for file in INVALID:
        refuse_as_announced(file)
