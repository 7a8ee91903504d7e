"""Deadlocks of two or three robots of a large team, each with the other robots anywhere."""

from safenav.runtime.resolution.problem import Floor as Moment
from safenav.runtime.traffic.deadlock import deadlock_of_few

from runtime.coordination.floors import Block, Bot, Floor

APART = ["######", "#....#", "##.###", "######", "#....#", "#....#", "######"]
"""A corridor (7 to 10) with a bay (14), and a room (25 to 28, 31 to 34) without a way there."""


def look(bots: dict[str, Bot], *blocks: Block, out: str = "") -> tuple[str, ...] | None:
    """The robots that are found to be deadlocked; one may be ``out`` of service."""
    drawn = Floor(APART, bots, blocks)
    moment = Moment(
        drawn.problem,
        drawn.problem.nothing_done,
        drawn.poses,
        tuple(bots),
        tuple(gate.name for gate in drawn.problem.gates),
    )
    among = [index for index, name in enumerate(bots) if name != out]
    found = deadlock_of_few(moment, among, 1, drawn.counts, lambda: None)
    return None if found is None else found[0].names


def room(*places: int) -> dict[str, Bot]:
    return {f"r{place}": Bot(f"{place}", [place]) for place in places}


CROWD = room(25, 26, 28, 33)


SWAP = {"a": Bot("7", [10]), "b": Bot("10", [7])}
MET = {"a": Bot("7e", [10]), "b": Bot("10w", [7])}
"""Both only turn: they cannot come back out of the corridor's end."""


def test_two_are_deadlocked_beside_any_other_robots() -> None:
    assert look({**CROWD, **MET}) == ("a", "b")
    assert look({**CROWD, **MET}, out="b") is None  # it may come back into service


def test_three_are_deadlocked_where_each_two_of_them_are_not() -> None:
    assert look({**CROWD, **SWAP}) is None
    assert look({**CROWD, **SWAP, "c": Bot("9", [8, 9])}) == ("a", "b", "c")


def test_four_are_deadlocked_that_never_move_again() -> None:
    """Each could only turn to where another one stands; any three of them get on."""
    full = {f"r{at}": Bot(at, [28]) for at in ("25w", "31s", "32w", "26w")}
    elsewhere = room(7, 10, 14)
    assert look({**elsewhere, **full}) == tuple(full)
    for name in full:
        assert look({**elsewhere, **{n: bot for n, bot in full.items() if n != name}}) is None


def test_an_obstacle_alone_deadlocks_no_robot() -> None:
    assert look({**CROWD, **SWAP}, Block(14, [("push", 1, (14,), False)])) is None
