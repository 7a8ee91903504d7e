"""The forms of an objective: those tried, why stronger ones fail, and their wording.

Whether a robot alone can patrol by the letter is compared with the explicit game of one player.
"""

from random import Random

import pytest

from safenav.explain.explanation import play
from safenav.scenario.objective import Cover, Hold, Objective, Once, Patrol, TargetObjective, Visit
from safenav.spec.task import Memory, ObjectiveForm, Weakening, can_keep, concession, forms
from safenav.world.map import Heading, RegionMap
from safenav.world.poses import Mobility, Pose, PoseGraph, region_mask


def floor(*rows: str) -> RegionMap:
    return RegionMap.from_grid(rows)


def test_it_agrees_with_the_game_played_out() -> None:
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
        some = random.sample(world.free, 3)
        patrol: TargetObjective = Patrol(
            (frozenset(some[:1]), frozenset(some[1 : random.randint(2, 3)]))
        )
        if random.random() < 0.5:
            patrol = Patrol(tuple(frozenset({region}) for region in some))
        blocked = frozenset(random.sample(world.free, random.randint(0, 2)))
        for memory in range(len(patrol.targets)):
            played = play(mobility, pose, patrol, Memory(memory), world, blocked).winnable
            graph = PoseGraph(world, mobility)
            told = can_keep(graph, pose, patrol, memory, region_mask(blocked))
            assert told == played, (world.grid_rows(), pose, patrol, blocked, memory)
            counts[played] += 1
    assert min(counts.values()) > 100


def at(*regions: int) -> frozenset[int]:
    return frozenset(regions)


def climbed(objective: Objective, start: int, turn: int = 0, **about: bool) -> list[ObjectiveForm]:
    """The forms for a robot in a corridor of five regions."""
    graph = PoseGraph(floor("....."), Mobility.FREE)
    return list(forms(objective, turn, Pose(start), graph, **about))


PLAIN = Visit((at(1), at(4)))


@pytest.mark.parametrize(
    "objective", [Visit((at(0), at(4))), Cover((at(0),)), Hold((at(3),)), Once((at(0),))]
)
def test_other_objectives_have_one_form(objective: Objective) -> None:
    assert climbed(objective, 2, shared=True) == [ObjectiveForm(objective, 0)]


def test_a_patrol_is_weakened_one_form_at_a_time() -> None:
    patrol = Patrol((at(1), at(4)))
    turned = ObjectiveForm(patrol, 1, Weakening.TURNED)
    last = ObjectiveForm(PLAIN, 0, Weakening.KEPT)
    assert climbed(patrol, 2) == [ObjectiveForm(patrol, 0), turned, last]
    assert climbed(patrol, 0) == [ObjectiveForm(patrol, 0), last]
    assert climbed(patrol, 0, 1) == [
        ObjectiveForm(patrol, 0, Weakening.TURNED),
        ObjectiveForm(PLAIN, 1, Weakening.KEPT),
    ]


def test_a_patrol_of_three_begins_with_the_next_target_that_it_can() -> None:
    circuit = Patrol((at(0), at(2), at(7)))
    graph = PoseGraph(floor("...", ".#.", "...", "#.#"), Mobility.FREE)
    turned, last = forms(circuit, 0, Pose(10), graph)
    assert turned == ObjectiveForm(circuit, 2, Weakening.TURNED)
    assert last == ObjectiveForm(Visit(circuit.targets), 0, Weakening.KEPT)
    assert concession(circuit, turned) == (
        "7 first: from here it cannot begin with the one whose turn it is without crossing 7"
    )


def test_a_robot_that_must_cross_a_target_patrols_by_alternation() -> None:
    wide = Patrol((at(0), at(1, 2)))
    (chosen_form,) = climbed(wide, 3)
    assert chosen_form == ObjectiveForm(Visit((at(0), at(1, 2))), 0, Weakening.CORRIDOR)
    assert concession(wide, chosen_form) == (
        "may cross a target on the way: the corridor leaves no other path"
    )
    assert climbed(Patrol((at(0), at(1, 2)), literal=True), 3) == [
        ObjectiveForm(Patrol((at(0), at(1, 2)), literal=True), 0)
    ]


def test_among_others_a_patrol_is_alternation_from_the_start() -> None:
    patrol = Patrol((at(1), at(4)))
    assert climbed(patrol, 2, shared=True) == [ObjectiveForm(PLAIN, 0, Weakening.SHARED)]
    assert climbed(patrol, 2, assigned=True) == [ObjectiveForm(PLAIN, 0, Weakening.ASSIGNED)]
    assert concession(patrol, ObjectiveForm(PLAIN, 0, Weakening.SHARED)) == (
        "may cross a target on the way and wait at one: it shares its floor with others"
    )


def test_obstacles_and_mobility_are_named_if_they_are_the_reason() -> None:
    ring = floor("...", ".#.", "...")
    patrol = Patrol((at(0), at(2)))
    graph = PoseGraph(ring, Mobility.FREE)
    (chosen_form,) = forms(Patrol((at(0), at(1, 2))), 0, Pose(5), graph, region_mask([7]))
    assert chosen_form.weakening is Weakening.OBSTACLES
    heading = PoseGraph(floor("....", "....", "...."), Mobility.HEADING)
    narrow = PoseGraph(floor("....."), Mobility.HEADING)
    assert next(forms(patrol, 0, Pose(5, Heading.EAST), heading)).weakening is None
    (chosen_form,) = forms(patrol, 0, Pose(3, Heading.EAST), narrow)
    assert chosen_form.weakening is Weakening.MOBILITY
