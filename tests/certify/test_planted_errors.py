"""Errors planted in the compiler are caught by the checker of bundles: see ``planted.yaml``."""

from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from certify.tasks import Circumstances, scenario_of, verdict_of
from once import from_yaml
from safenav.spec.specification import Section, Specification
from safenav.spec.task import Memory

DATA = from_yaml((Path(__file__).parent / "planted.yaml").read_text())


def planted(spec: Specification, what: dict[str, Any]) -> Specification:
    """The specification with an error, which must be one."""
    if more := what.get("more"):
        section, formula = more
        extra = replace(spec.constraints[0], section=Section(section), formula=formula, regions=())
        return replace(spec, constraints=(*spec.constraints, extra))
    wanted = [c for c in spec.constraints if what.get("section") in (None, c.section.value)]
    if parts := what.get("without"):
        gone = [c for c in wanted if any(part in c.formula for part in parts)]
        assert gone
        return spec.without(gone)
    after = spec.constraints
    for old, new in what["exchange"].items():
        after = tuple(
            replace(c, formula=c.formula.replace(old, new)) if before in wanted else c
            for before, c in zip(spec.constraints, after, strict=True)
        )
    assert after != spec.constraints
    return replace(spec, constraints=after)


ACCEPTED = set[str]()
"""Circumstances under which the strategy is accepted without an error."""


@pytest.mark.parametrize("name", DATA["errors"])
def test_a_planted_error_is_caught(name: str, tmp_path: Path) -> None:
    error = DATA["errors"][name]
    grid = DATA["grids"][error.get("grid", "open")]
    scenario = scenario_of(grid, error["robots"], error.get("more", ""))
    given = error.get("about", {})
    about = Circumstances(tuple(given.get("closed", ())))
    if "memory" in given:
        about = Circumstances(memory=Memory(given["memory"]))
    if (right := str((grid, error["robots"], error.get("more"), given))) not in ACCEPTED:
        assert verdict_of(scenario, tmp_path / "right", about) == ""
        ACCEPTED.add(right)
    said = verdict_of(scenario, tmp_path / "wrong", about, lambda s: planted(s, error["planted"]))
    assert error["reason"] in said
