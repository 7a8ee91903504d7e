"""One label for each robot, wherever it is drawn."""

import pytest

from safenav.trace.labels import labels


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["quad", "digit"], ["Q", "D"]),
        (["quad", "quad_2"], ["Q", "Q2"]),
        (["drone", "digit"], ["Dr", "Di"]),
        (["rover-1", "rover-2", "arm"], ["R1", "R2", "A"]),
        (["robot_0", "robot_1", "robot_10", "robot_11"], ["R0", "R1", "10", "11"]),
    ],
    ids=["initials", "a plain one and a second", "letters", "numbers", "twelve"],
)
def test_labels_are_short_and_sensible(names: list[str], expected: list[str]) -> None:
    found = labels(names)
    assert [found[name] for name in names] == expected


@pytest.mark.parametrize("count", [2, 12, 30])
@pytest.mark.parametrize("form", ["robot_{}", "r{}", "{}", "scout-{:03}", "same{}same"])
def test_no_two_robots_share_a_label(form: str, count: int) -> None:
    names = [form.format(number) for number in range(count)]
    found = labels(names)
    assert len(set(found.values())) == count
    assert all(1 <= len(label) <= 2 for label in found.values())
