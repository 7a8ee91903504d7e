"""A bundle whose run discovers a known obstacle again, as another one, is refused."""

from pathlib import Path

import pytest

from certify.making import bundle_at, files_of, judged, rewrite
from certify.mutants import lines_of, with_lines
from runtime.facts import case


@pytest.mark.parametrize("name", ["robots.b", "b", "any robot"])
def test_an_obstacle_with_the_name_of_a_robot_is_refused(name: str, tmp_path: Path) -> None:
    """Who knows of the one would seem to know of the other, and what is never resolved would seem
    to be somebody who is stuck."""
    said = discovering(tmp_path, name=name)
    assert "cannot name an obstacle" in said


def test_a_known_obstacle_that_is_discovered_again_is_refused(tmp_path: Path) -> None:
    """It could stand elsewhere from then on, for others, or need less."""
    assert discovering(tmp_path, region=12).endswith("pile@7 is known already")


def discovering(target: Path, **other: object) -> str:
    """What the checker says of a run that discovers its obstacle again, as another one."""
    bundle = bundle_at("plan", case("certified/helper_for_the_next_need"))
    files = files_of(bundle)
    header, *lines = lines_of(files)
    obstacle = header["scenario"]["obstacles"][0] | other
    discovered = {"type": "discovered", "tick": 0, "obstacle": obstacle}
    files = with_lines(files, [header, discovered, *lines])
    return judged(rewrite(bundle, files, target / "bundle"))[1].splitlines()[-1]
