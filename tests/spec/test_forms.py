"""The forms of an objective: those tried, why stronger ones fail, and their wording.

Whether a robot alone can patrol by the letter is compared with the explicit game of one player.
"""

from random import Random

import networkx as nx
import pytest

from safenav import Heading, Pose, RegionMap, SafenavError
from safenav.explain.explanation import play
from safenav.scenario.objective import Cover, Hold, Objective, Once, Patrol, Visit
from safenav.spec.specification import Constraint, Origin, Section
from safenav.spec.task import Memory, ObjectiveForm, Weakening, can_keep, concession, forms
from safenav.world.poses import Mobility, PoseGraph, bits, region_mask


def floor(*rows: str) -> RegionMap:
    return RegionMap.from_grid(rows)


def at(*regions: int) -> frozenset[int]:
    return frozenset(regions)


def test_possible_forms_are_those_that_a_search_of_the_game_finds() -> None:
    random = Random(11)
    counts = {True: 0, False: 0}
    for _ in range(400):
        rows, cols = random.randint(1, 4), random.randint(3, 6)
        world = floor(*("".join(random.choices("#.", (1, 4), k=cols)) for _ in range(rows)))
        if len(world.free) < 3:
            continue
        heading = random.choice([None, *Heading])
        mobility = Mobility.FREE if heading is None else Mobility.HEADING
        pose = Pose(random.choice(world.free), heading)
        a, b, c = random.sample(world.free, 3)
        targets = [(at(a), at(b)), (at(a), at(b, c)), (at(a, b), at(b, c)), (at(a), at(b), at(c))]
        patrol = Patrol(random.choice((*targets, targets[-1])))
        blocked = frozenset(random.sample(world.free, random.randint(0, 2)))
        for memory in range(len(patrol.targets)):
            played = play(mobility, pose, patrol, Memory(memory), world, blocked).winnable
            graph = PoseGraph(world, mobility)
            told = can_keep(graph, pose, patrol, memory, region_mask(blocked))
            assert told == played, (world.grid_rows(), pose, patrol, blocked, memory)
            counts[played] += 1
    assert min(counts.values()) > 100


def climbed(objective: Objective, start: int, turn: int = 0, **about: bool) -> list[ObjectiveForm]:
    """The forms for a robot in a corridor of five regions."""
    graph = PoseGraph(floor("....."), Mobility.FREE)
    return list(forms(objective, turn, Pose(start), graph, **about))


PATROL = Patrol((at(1), at(4)))
PLAIN = Visit((at(1), at(4)))
WIDE = Patrol((at(0), at(1, 2)))
LITERAL = Patrol((at(0), at(1, 2)), literal=True)


@pytest.mark.parametrize(
    ("objective", "start", "turn", "about", "expected"),
    [
        *(
            (objective, 2, 0, {"planned": True}, [(objective, 0, None)])
            for objective in (
                Visit((at(0), at(4))),
                Cover((at(0),)),
                Hold((at(3),)),
                Once((at(0),)),
            )
        ),
        (PATROL, 2, 0, {}, [(PATROL, 0, None), (PATROL, 1, "TURNED"), (PLAIN, 0, "KEPT")]),
        (PATROL, 2, 1, {}, [(PATROL, 1, None), (PATROL, 0, "TURNED"), (PLAIN, 1, "KEPT")]),
        (PATROL, 0, 0, {}, [(PATROL, 0, None), (PLAIN, 0, "KEPT")]),
        (PATROL, 0, 1, {}, [(PATROL, 0, "TURNED"), (PLAIN, 1, "KEPT")]),
        (PATROL, 2, 0, {"planned": True}, [(PLAIN, 0, "PLANNED")]),
        (PATROL, 2, 0, {"assigned": True}, [(PLAIN, 0, "ASSIGNED")]),
        (WIDE, 3, 0, {}, [(WIDE.relaxed(), 0, "CORRIDOR")]),
        (LITERAL, 3, 0, {}, [(LITERAL, 0, None)]),
    ],
)
def test_a_patrol_is_weakened_one_form_at_a_time(
    objective: Objective,
    start: int,
    turn: int,
    about: dict[str, bool],
    expected: list[tuple[Objective, int, str | None]],
) -> None:
    """Other objectives, and literal ones, have one form; among others a patrol is alternation from
    the start."""
    assert climbed(objective, start, turn, **about) == [
        ObjectiveForm(form, first, Weakening[why] if why else None) for form, first, why in expected
    ]


def test_a_patrol_of_three_begins_with_the_next_target_that_it_can_reach() -> None:
    circuit = Patrol((at(0), at(2), at(7)))
    graph = PoseGraph(floor("...", ".#.", "...", "#.#"), Mobility.FREE)
    turned, last = forms(circuit, 0, Pose(10), graph)
    assert turned == ObjectiveForm(circuit, 2, Weakening.TURNED)
    assert last == ObjectiveForm(Visit(circuit.targets), 0, Weakening.KEPT)
    assert concession(circuit, turned) == (
        "7 first: from here it cannot begin with the one whose turn it is without crossing 7"
    )


def test_a_weaker_form_states_its_reason() -> None:
    crosses = ObjectiveForm(WIDE.relaxed(), 0, Weakening.CORRIDOR)
    assert concession(WIDE, crosses) == (
        "may cross a target on the way: the map leaves no other path"
    )
    assert concession(PATROL, ObjectiveForm(PLAIN, 0, Weakening.PLANNED)) == (
        "may cross a target on the way and wait at one: a joint plan drives it"
    )


def test_obstacles_and_mobility_are_named_if_they_are_the_reason() -> None:
    ring = PoseGraph(floor("...", ".#.", "..."), Mobility.FREE)
    (form,) = forms(WIDE, 0, Pose(5), ring, region_mask([7]))
    assert form.weakening is Weakening.OBSTACLES
    patrol, pose = Patrol((at(0), at(2))), Pose(5, Heading.EAST)
    room = PoseGraph(floor("....", "....", "...."), Mobility.HEADING)
    assert next(forms(patrol, 0, pose, room)).weakening is None
    narrow = PoseGraph(floor("....."), Mobility.HEADING)
    (form,) = forms(patrol, 0, Pose(3, Heading.EAST), narrow)
    assert form.weakening is Weakening.MOBILITY


def test_the_poses_around_a_pose_have_paths_from_it_and_back() -> None:
    random, one_way = Random(1), 0
    for _ in range(40):
        world = floor(*("".join(random.choices("#.", (1, 3), k=5)) for _ in range(4)))
        graph = PoseGraph(world, Mobility.HEADING)
        poses = [p for p in bits(graph.poses_on(region_mask(world.free))) if random.random() < 0.8]
        allowed = sum(1 << pose for pose in poses)
        steps = nx.DiGraph([(p, q) for p in poses for q in (p, *graph.steps(p)) if q in poses])
        for part in nx.strongly_connected_components(steps):
            pose = random.choice([*part])
            assert {*bits(graph.around(1 << pose, allowed))} == part
            one_way += {*bits(graph.closure(1 << pose, allowed))} != part
    assert one_way > 100


def test_a_constraint_with_swapped_arguments_is_refused() -> None:
    with pytest.raises(SafenavError, match="takes a Section and a formula, not str and Section"):
        Constraint("region = 1", Section.SYS_INIT, Origin("robots.a", "its start"))  # type: ignore[arg-type]
