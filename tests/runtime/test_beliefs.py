"""A robot with limited sight; random ones: ``campaigns``."""

from pathlib import Path

from runtime.played import completed, play

CASE_STUDY_3 = Path(__file__).parents[2] / "scenarios" / "case_study_3.yaml"


def test_case_study_3_with_a_digit_that_sees_four_regions() -> None:
    """The paper's own belief tracking: nothing depends on where the quadcopter is, so the
    robots do what they do without it."""
    text = CASE_STUDY_3.read_text()
    usual = play(text)
    told = "digit: {model: digit, vision: 4, tracks: [quad],"
    trace = completed(text.replace("digit: {model: digit,", told))
    kinds = ("violation", "request", "push", "resolved", "pop")
    assert trace.order(*kinds) == usual.order(*kinds)
    beliefs = trace.all("belief", robot="digit", of="quad")
    assert any(b["seen"] for b in beliefs) and not all(b["seen"] for b in beliefs)
    assert not usual.all("belief")
