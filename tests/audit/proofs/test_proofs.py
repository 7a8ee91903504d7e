"""Proofs of negatives: sound ones are accepted, false and forged ones get a reason."""

import copy
import hashlib
import json
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from safenav.audit.language import HEADINGS, Pose
from safenav.audit.needs import Need, OpenObstacle
from safenav.audit.poses import PoseGraph
from safenav.audit.possibilities.members import Member
from safenav.audit.possibilities.team import Team, TooManyError
from safenav.audit.proofs.case import Case, RemainingGoals
from safenav.audit.proofs.joint import can_be_served
from safenav.audit.rules.proofs import problems_of

# A corridor of regions 1 to 5; no robot may enter 0 or 6.
FREE = frozenset(range(1, 6))


class Robot(NamedTuple):
    name: str
    pose: Pose
    targets: tuple[int, ...]
    can: frozenset[str]


class Action(NamedTuple):
    """A need, and who can meet it."""

    action: str
    regions: frozenset[int]
    robots: int
    together: bool


def robot(name: str, at: int, *targets: int, can: str = "", heading: str | None = None) -> Robot:
    return Robot(name, (at, heading), targets, frozenset(can.split()))


def obstacle(name: str, at: int, *needs: Action, blocks: str) -> tuple[Any, ...]:
    return name, at, needs, frozenset(blocks.split())


def need(action: str, *regions: int, robots: int = 1, together: bool = False) -> Action:
    return Action(action, frozenset(regions), robots, together)


def corridor(heading: str | None) -> dict[Pose, tuple[Pose, ...]]:
    """The steps of a robot with a heading, if it has one: it cannot turn round there."""
    east, west = ("east", "west") if heading else (None, None)
    steps: dict[Pose, tuple[Pose, ...]] = {}
    for region in FREE:
        for faced in HEADINGS if heading else (None,):
            ways = [(region + 1, east)] * (faced != "west" or not heading)
            ways += [(region - 1, west)] * (faced != "east" or not heading)
            steps[region, faced] = tuple(way for way in ways if way[0] in FREE)
    return steps


def moment(robots: list[Robot], *obstacles: tuple[Any, ...], together: bool = False) -> Case:
    everybody = {one.name for one in robots}
    members, remaining = dict[str, Member](), dict[str, RemainingGoals]()
    for one in robots:
        steps = corridor(one.pose[1])
        aims = tuple(frozenset(p for p in steps if p[0] == target) for target in one.targets)
        rivals = frozenset(everybody - {one.name} if together else ())
        members[one.name], remaining[one.name] = (
            Member(PoseGraph(steps), aims, rivals),
            RemainingGoals(aims),
        )
    opens = tuple(
        OpenObstacle(
            name,
            at,
            blocks,
            tuple(
                Need(frozenset(r.name for r in robots if n.action in r.can), *n[1:]) for n in needs
            ),
        )
        for name, at, needs, blocks in obstacles
    )
    return Case(Team(members), {one.name: one.pose for one in robots}, opens, remaining)


def table(regions: range, live: bool, heading: str | None = None) -> dict[str, Any]:
    return {"poses": [[region, heading] for region in regions], "live": live}


def closure(never: str, **robots: dict[str, Any]) -> dict[str, Any]:
    return {"kind": "closure", "resolved": [], "never": never.split(), "robots": robots}


def reasons(proof: dict[str, Any], about: Case) -> list[str]:
    try:
        return list(problems_of(proof, about))
    except TooManyError as large:
        return [str(large)]


# Closures

NOBODY = moment(
    [robot("a", 1, 5, 1), robot("b", 2, 1, 2, can="sense")],
    obstacle("door@4", 4, need("push", 4), blocks="a b"),
)
NO_PUSHER = closure("door@4", a=table(range(1, 4), False), b=table(range(1, 4), True))


def changed(proof: dict[str, Any], *path: Any, to: Any) -> dict[str, Any]:
    found = copy.deepcopy(proof)
    inner: Any = found
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return found


@pytest.mark.parametrize(
    ("proof", "reason"),
    [
        (changed(NO_PUSHER, "robots", "a", "poses", to=[[1, None], [2, None]]), "outside its"),
        (changed(NO_PUSHER, "robots", "a", "poses", to=[[3, None]]), "begins at 1, outside"),
        (changed(NO_PUSHER, "robots", "a", "live", to=True), "proves nothing"),
        (changed(NO_PUSHER, "robots", "b", "live", to=False), "b can continue forever"),
        (changed(NO_PUSHER, "never", to=[]), "omits door@4"),
        (changed(NO_PUSHER, "never", to=["door@4", "door@2"]), "door@2 is unknown"),
        (changed(NO_PUSHER, "robots", to={"a": table(range(1, 4), False)}), "not the whole"),
        (changed(NO_PUSHER, "robots", "a", to={"poses": [[1, None]]}), "cannot be read"),
        (changed(NO_PUSHER, "robots", "a", "poses", to=[[1]]), "cannot be read"),
        (changed(NO_PUSHER, "never", to=None), "cannot be read"),
        ({"kind": "belief"}, "unknown kind of proof: 'belief'"),
    ],
)
def test_a_closure_that_does_not_hold_gets_a_reason(proof: dict[str, Any], reason: str) -> None:
    assert reason in " ".join(reasons(proof, NOBODY))


def test_an_obstacle_that_a_robot_can_resolve_is_not_permanent() -> None:
    able = moment(
        [robot("a", 1, 5, 1), robot("b", 2, 1, 2, can="push")],
        obstacle("door@4", 4, need("push", 3), blocks="a b"),
    )
    assert "can be resolved" in reasons(NO_PUSHER, able)[0]


CLOSURES = {
    "nobody can open the door": (NO_PUSHER, NOBODY),
    "a pusher behind the door does not help where it cannot get": (
        closure("door@3 fog@4", a=table(range(1, 3), False), b=table(range(5, 6), True)),
        moment(
            [robot("a", 1, 5, 1), robot("b", 5, 5, can="push")],
            obstacle("door@3", 3, need("push", 2), blocks="a b"),
            obstacle("fog@4", 4, need("sense", 2), blocks="b"),
        ),
    ),
    "a second need that nobody can meet is enough": (
        closure("vault@3", a=table(range(1, 3), False)),
        moment(
            [robot("a", 1, 5, 1, can="sense")],
            obstacle("vault@3", 3, need("sense", 2), need("lift", 2), blocks="a"),
        ),
    ),
}


@pytest.mark.parametrize("why", CLOSURES)
def test_a_closure_proves_its_claim(why: str) -> None:
    assert reasons(*CLOSURES[why]) == []


@pytest.mark.parametrize(("apart", "accepted"), [(True, True), (False, False)])
def test_robots_that_keep_apart_do_not_lift_together_on_one_region(
    apart: bool, accepted: bool
) -> None:
    beam = moment(
        [robot("a", 1, 5, 1), robot("b", 1, 1, can="lift"), robot("c", 2, 2, can="lift")],
        obstacle("beam@4", 4, need("lift", 3, robots=2, together=True), blocks="a b c"),
        together=apart,
    )
    proof = closure(
        "beam@4",
        a=table(range(1, 4), False),
        b=table(range(1, 6), True),
        c=table(range(1, 6), True),
    )
    assert (reasons(proof, beam) == []) is accepted


# Trees

# With a heading no robot can return: one that senses at 1 can never push at 5, and vice versa.
ONE_WAY = moment(
    [robot("a", 3, 3, heading="east", can="push"), robot("b", 3, 1, 5)],
    obstacle("west@2", 2, need("push", 4), blocks="b"),
    obstacle("east@4", 4, need("push", 2), blocks="b"),
)


def one_way_proof() -> dict[str, Any]:
    """It faces east, so that only the one at 2 can be resolved, from 4."""
    after = closure(
        "east@4",
        a={"poses": [[4, "east"], [5, "east"]], "live": False},
        b=table(range(1, 4), False),
    )
    option = {"obstacle": "west@2", "need": 0, "robots": ["a"]}
    return {"kind": "tree", "choices": [{"option": option, "proof": after}]}


def test_a_tree_that_refutes_each_choice_is_accepted() -> None:
    assert reasons(one_way_proof(), ONE_WAY) == []


def test_a_tree_that_leaves_a_choice_out_or_refutes_it_wrongly_is_refused() -> None:
    proof = {"kind": "tree", "choices": []}
    assert "a at west@2 is not refuted" in reasons(proof, ONE_WAY)[0]
    proof = changed(one_way_proof(), "choices", 0, "proof", "robots", "b", "poses", to=[[3, None]])
    assert "outside its closure" in reasons(proof, ONE_WAY)[0]


def test_one_lossless_choice_stands_for_all() -> None:
    """Two can push at once; whoever does it can come back, so that one of them is enough."""
    about = moment(
        [robot("a", 1, 1, can="push"), robot("b", 2, 2, can="push"), robot("c", 1, 5)],
        obstacle("door@4", 4, need("push", 3), blocks="a b c"),
        obstacle("wall@5", 5, need("lift", 4), blocks="a b c"),
    )
    after = closure(
        "wall@5",
        a=table(range(1, 5), True),
        b=table(range(1, 5), True),
        c=table(range(1, 5), False),
    )
    option = {"obstacle": "door@4", "need": 0, "robots": ["b"]}
    proof = {"kind": "tree", "choices": [{"option": option, "proof": after}]}
    assert reasons(proof, about) == []


# Joint searches


def joint_proof(about: Case, poses: list[list[Pose]]) -> dict[str, Any]:
    lines = sorted(
        json.dumps([list(pose) for pose in one], separators=(",", ":")) + "\n" for one in poses
    )
    return {
        "kind": "joint",
        "robots": list(about.at),
        "start": {name: list(pose) for name, pose in about.at.items()},
        "stages": {one.name: 0 for one in about.obstacles},
        "goal": {"rounds": 1},
        "states": len(poses),
        "sha256": hashlib.sha256("".join(lines).encode()).hexdigest(),
    }


PASSING = moment([robot("a", 1, 5), robot("b", 5, 1)], together=True)
ORDERED = [[(a, None), (b, None)] for a in FREE for b in FREE if a < b]


def test_robots_that_cannot_pass_each_other_are_proven_to_be_stuck() -> None:
    assert reasons(joint_proof(PASSING, ORDERED), PASSING) == []


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("states", 9, "reachable than the 9 of"),
        ("states", 11, "10 states are reachable, not 11"),
        ("states", 10**9, "exceed the 200000"),
        ("sha256", "0" * 64, "sha256"),
        ("start", {"a": [2, None], "b": [5, None]}, "not where the proof begins"),
        ("robots", [], "names no robots"),
        ("stages", {"door@3": 0}, "door@3 is unknown"),
    ],
)
def test_a_joint_proof_that_does_not_hold_gets_a_reason(
    field: str, value: Any, reason: str
) -> None:
    proof = changed(joint_proof(PASSING, ORDERED), field, to=value)
    assert reason in " ".join(reasons(proof, PASSING))


def test_a_team_that_can_complete_is_not_deadlocked() -> None:
    about = moment([robot("a", 1, 2), robot("b", 5, 4)], together=True)
    assert (
        "every objective is met with a at 2, b at 4"
        in reasons(joint_proof(about, ORDERED), about)[0]
    )


@pytest.mark.parametrize("flat", [None, "empty"])
def test_the_resolution_of_a_battery_resets_no_rounds(flat: str | None) -> None:
    """a has met its target behind v, and could not get there again."""
    robots = [robot("a", 1, 5), robot("v", 3, 3, can="lift")]
    about = moment(robots, obstacle("empty@2", 2, need("lift", 4), blocks=""), together=True)
    battery = about.obstacles[0]._replace(order=("empty", 2, 1))
    remaining = {**about.remaining, "a": replace(about.remaining["a"], rounds_left=0)}
    about = replace(about, obstacles=(battery,), remaining=remaining, flat=flat)
    assert can_be_served({"empty@2"}, about, 1000) is (flat is not None)


def test_a_proof_that_omits_a_robot_that_could_help_is_refused() -> None:
    about = moment(
        [robot("a", 1, 5), robot("b", 5, 1), robot("c", 3, 3, can="push")],
        obstacle("door@3", 3, need("push", 2), blocks="a b"),
        together=True,
    )
    proof = joint_proof(PASSING, ORDERED) | {"stages": {"door@3": 0}}
    assert "c, which the proof omits" in reasons(proof, about)[0]
    away = joint_proof(PASSING, ORDERED)
    assert reasons(away, about) == []


def test_two_robots_that_lift_together_open_the_path_for_each_other() -> None:
    """The same floor with a beam that they can lift: what is behind it counts, too."""
    about = moment(
        [robot("a", 1, 5, can="lift"), robot("b", 2, 4, can="lift")],
        obstacle("beam@3", 3, need("lift", 1, 2, robots=2, together=True), blocks="a b"),
        together=True,
    )
    found = reasons(joint_proof(about, [[(1, None), (2, None)]]), about)
    assert "reachable than the 1 of" in found[0]


# Room

ENDS = moment([robot("a", 1, 3), robot("b", 5, 3), robot("c", 2, 4)], together=True)


@pytest.mark.parametrize(
    ("robots", "change", "reason"),
    [
        ("a b", {}, ""),
        ("a b c", {}, ""),
        ("a c", {}, "there is room at 3, 4 for 2 robots"),
        ("a", {}, "there is room at 3 for 1 robots"),
        ("a d", {}, "the proof names d"),
        ("", {}, "the proof names no robots"),
        ("a b", {"settles": False}, "a does not have to stay at a target"),
    ],
)
def test_robots_without_room_are_counted(robots: str, change: Any, reason: str) -> None:
    ends = {n: replace(own, **({"settles": True} | change)) for n, own in ENDS.remaining.items()}
    proof = {"kind": "room", "robots": robots.split()}
    assert "".join(reasons(proof, replace(ENDS, remaining=ends))) == reason


def test_robots_that_may_share_a_region_have_room() -> None:
    about = moment([robot("a", 1, 3), robot("b", 5, 3)])
    ends = {name: replace(own, settles=True) for name, own in about.remaining.items()}
    proof = {"kind": "room", "robots": ["a", "b"]}
    assert reasons(proof, replace(about, remaining=ends)) == ["a and b may share a region"]


def test_a_joint_proof_is_about_a_moment_with_all_robots_at_their_ends() -> None:
    """Each can meet its target while the other one is elsewhere."""
    about = moment([robot("a", 1, 4), robot("b", 2, 3)], together=True)
    assert "every objective is met" in reasons(joint_proof(about, ORDERED), about)[0]
    ends = {name: replace(own, settles=True) for name, own in about.remaining.items()}
    assert reasons(joint_proof(about, ORDERED), replace(about, remaining=ends)) == []
