"""Random teams on one floor that once broke a rule of the audit."""

import pytest

from runtime.played import play
from runtime.teams import team_scenario

FOUND = {
    686: "a robot on its way to where it will wait was taken to wait there already",
    4: "others gave way to one robot again and again, in the same way, to no avail",
    7: "two robots each waited for the other's region although another side was free",
}


@pytest.mark.parametrize("seed", FOUND)
def test_seeds_of_former_findings_pass_the_audit(seed: int) -> None:
    assert play(team_scenario(seed)).outcome["explanation"]
