"""Situations in which coordination layers fail, each played with the real synthesizer."""

import pytest

from runtime.played import completed, play
from safenav.errors import InputError


def test_resolving_what_nobody_asked_for_pops_nothing() -> None:
    trace = completed("""
        map: {grid: ["########", "#......#", "########"]}
        robots:
          opener: {model: digit, start: 9, heading: east, objective: {hold: 14}}
          flyer: {model: quadcopter, start: 9, objective: {visit: [14, 9]}}
        obstacles: [{type: door, region: 12}]
        """)
    assert trace.one("resolved")["requested"] is False
    assert trace.all("pop") == trace.all("push") == []


def test_unasked_resolution_while_a_request_is_open_leaves_the_stack_alone() -> None:
    # The flyer waits for door 12; on its way there the opener opens door 16, too.
    trace = play("""
        map: {grid: ["##########", "#........#", "########.#", "##########"]}
        catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: [push]}}}
        robots:
          flyer: {model: quadcopter, start: 11, objective: {visit: [14, 11]}}
          opener: {model: rover, start: 28, objective: {hold: 28}}
        obstacles: [{type: door, region: 12}, {type: door, region: 16}]
        until: {rounds: 1}
        """)
    first, second = trace.all("resolved")
    assert (first["obstacle"], first["requested"]) == ("door@16", False)
    assert (second["obstacle"], second["requested"]) == ("door@12", True)
    assert len(trace.all("push")) == len(trace.all("pop")) == 1
    assert trace.one("pop")["tick"] == second["tick"]


def test_helper_that_stands_on_its_own_target_still_goes() -> None:
    trace = completed("""
        map: {grid: ["#########", "#.......#", "#.......#", "#########"]}
        robots:
          flyer: {model: quadcopter, start: 10, objective: {patrol: [13, 10]}}
          opener: {model: digit, start: 25, heading: west, objective: {hold: 25}}
        obstacles: [{type: door, region: 12}, {type: door, region: 21}]
        until: {rounds: 1}
        """)
    assert trace.all("request")[0]["helper"] == "opener"
    assert trace.all("resolved")[0]["robot"] == "opener"


def test_robot_that_faces_the_obstacle_can_wait_and_turn() -> None:
    # Digit faces the uncertain region with a wall on its left: it cannot turn on the spot. It
    # waits, and when the region proves untraversable it turns off to the right.
    trace = completed("""
        map: {grid: ["########", "#......#", "#..##..#", "#......#", "########"]}
        robots:
          quad: {model: quadcopter, start: 30, objective: {hold: 30}}
          digit: {model: digit, start: 9, heading: east, objective: {visit: [14, 25]}}
        obstacles: [{type: uncertainty, region: 11, traversable: false}]
        until: {rounds: 1}
        """)
    violation, resolved = trace.one("violation"), trace.one("resolved")
    assert (violation["at"], violation["proposed"]) == (10, 11)
    waiting = range(violation["tick"], resolved["tick"])  # quad's turn is before digit's
    assert {trace.position("digit", tick) for tick in waiting} == {10}
    assert trace.position("digit", resolved["tick"]) == 18
    assert 11 not in trace.path("digit")


def test_second_request_while_the_first_is_pending() -> None:
    trace = completed("""
        map: {grid: ["###########", "#....#....#", "#....#....#", "#.........#", "###########"]}
        robots:
          one: {model: quadcopter, start: 12, objective: {visit: [15, 12]}}
          two: {model: quadcopter, start: 17, objective: {visit: [20, 17]}}
          opener: {model: digit, start: 38, heading: east, objective: {hold: 38}}
        obstacles: [{type: door, region: 13}, {type: door, region: 18}]
        until: {rounds: 1}
        """)
    assert [r["obstacle"] for r in trace.all("request")][:2] == ["door@13", "door@18"]
    assert [p["depth"] for p in trace.all("push")][:2] == [1, 2]
    assert {r["obstacle"] for r in trace.all("resolved")} == {"door@13", "door@18"}


def test_two_robots_meet_the_same_obstacle() -> None:
    trace = completed("""
        map: {grid: ["###########", "#...#.....#", "#.........#", "#...#.....#", "###########"]}
        catalogue:
          robots:
            low: {mobility: free, layer: low, capabilities: []}
            high: {mobility: free, layer: high, capabilities: []}
        robots:
          one: {model: low, start: 13, objective: {visit: [27, 13]}}
          two: {model: high, start: 35, objective: {visit: [28, 35]}}
          opener: {model: digit, start: 20, heading: north, objective: {hold: 20}}
        obstacles: [{type: door, region: 26}]
        until: {rounds: 1}
        """)
    requests = trace.all("request")
    assert [(r["obstacle"], r["helper"]) for r in requests] == [("door@26", "opener")] * 2
    assert len(trace.all("resolved")) == 1
    assert [p["depth"] for p in trace.all("pop")] == [1, 0]


def test_a_resolved_request_leaves_the_stack_wherever_it_stands_in_it() -> None:
    # 'one' asks first, but 'near' opens its door after 'far' has been asked for the other and
    # before 'far' gets there.
    trace = completed("""
        map:
          grid: |
            ###############
            #.............#
            #.............#
            #.............#
            ###############
        catalogue:
          robots:
            blue: {mobility: free, layer: air, capabilities: []}
            red: {mobility: free, layer: sky, capabilities: []}
            gun: {mobility: free, layer: ground, capabilities: [push]}
            saw: {mobility: free, layer: field, capabilities: [cut]}
          obstacles:
            fence: {action: cut, resolve_at: self}
        robots:
          one: {model: blue, start: 16, objective: {visit: [18, 16]}}
          two: {model: red, start: 46, objective: {visit: [49, 46]}}
          near: {model: gun, start: 22, objective: {hold: 22}}
          far: {model: saw, start: 58, objective: {hold: 58}}
        obstacles: [{type: door, region: 17}, {type: fence, region: 48},
                    {type: door, region: 32}, {type: fence, region: 33}]
        until: {rounds: 1}
        """)
    pops = trace.all("pop")
    door, fence = trace.all("resolved")[:2]
    assert (door["obstacle"], fence["obstacle"]) == ("door@17", "fence@48")
    assert [p["depth"] for p in pops[:2]] == [1, 0]
    assert [pop["tick"] for pop in pops[:2]] == [door["tick"], fence["tick"]]
    assert [pop["obstacle"] for pop in pops[:2]] == ["door@17", "fence@48"]


def test_untraversable_region_blocks_only_whom_it_blocks() -> None:
    trace = completed("""
        map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
        robots:
          quad: {model: quadcopter, start: 19, objective: {visit: [11, 8]}}
          digit: {model: digit, start: 8, heading: east, objective: {visit: [11, 15]}}
        obstacles: [{type: uncertainty, region: 10, traversable: false}]
        """)
    assert trace.one("blocked")["robots"] == ["digit"]
    assert 10 in trace.path("quad")
    assert 10 not in trace.path("digit")


def test_helper_leaves_the_doorway_on_the_far_side_and_comes_back() -> None:
    # With heading mobility the opener can only walk on through the door; the literal Patrol
    # formula would forbid it to come back through it.
    trace = completed("""
        map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
        robots:
          flyer: {model: quadcopter, start: 10, objective: {visit: [16, 10]}}
          opener: {model: digit, start: 28, heading: west, objective: {patrol: [12, 28]}}
        obstacles: [{type: door, region: 22}]
        """)
    resolved = trace.one("resolved")
    after = trace.path("opener")[resolved["tick"] :]
    assert after[0] == 23  # the far side
    assert {12, 28} <= set(after)


def test_patrol_with_both_targets_equal_is_told_to_hold() -> None:
    with pytest.raises(InputError, match="hold"):
        play("""
            map: {grid: "####\\n#..#\\n####\\n"}
            robots: {a: {model: quadcopter, start: 5, objective: {patrol: [6, 6]}}}
            """)


@pytest.mark.parametrize(("start", "first"), [(8, 0), (11, 1)], ids=["first", "second"])
def test_patrol_may_start_on_either_target(start: int, first: int) -> None:
    trace = completed(f"""
        map: {{grid: ["######", "#....#", "######"]}}
        robots: {{a: {{model: quadcopter, start: {start - 1}, objective: {{patrol: [7, 10]}}}}}}
        """)
    goals = trace.all("goal")
    assert goals[0]["goal"] == first
    assert [g["goal"] for g in goals] == [(first + i) % 2 for i in range(len(goals))]


def test_detour_around_what_nobody_can_resolve() -> None:
    trace = completed("""
        map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
        robots: {flyer: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}}
        obstacles: [{type: door, region: 10}]
        """)
    assert trace.one("request")["bids"] == {}
    assert trace.one("blocked")["reason"] == "no_capable_robot"
    assert 10 not in trace.path("flyer")


BETWEEN_WALLS = """\
# Digit stands at 9 between walls, faces 10, and cannot go back: no strategy is left.
map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
robots:
  quad: {model: quadcopter, start: 26, objective: {hold: 26}}
  digit: {model: digit, start: 8, heading: east, objective: {visit: [12, 8]}}
obstacles: [{type: uncertainty, region: 10, traversable: false}]
"""

NO_DETOUR = """
map: {grid: ["#######", "#.....#", "#######"]}
robots: {flyer: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}}
obstacles: [{type: door, region: 10}]
"""

WAIT_FOR_EACH_OTHER = """\
# The rover can get to the quadcopter's door through the uncertain region only, and the
# quadcopter to the uncertain region through the door only.
map: {grid: ["###########", "#.........#", "###########"]}
catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: [push]}}}
robots:
  rover: {model: rover, start: 12, objective: {visit: [19, 12]}}
  quad: {model: quadcopter, start: 20, objective: {visit: [12, 20]}}
obstacles: [{type: uncertainty, region: 14}, {type: door, region: 17}]
"""

FACE_TO_FACE = """\
# Both start inside the corridor, face to face: neither can turn on the spot.
map: {grid: ["###########", "#..#####..#", "#.........#", "#..#####..#", "###########"]}
robots:
  a: {model: digit, start: [2, 4], heading: east, objective: {visit: [[2, 9], [2, 1]]}}
  b: {model: digit, start: [2, 6], heading: west, objective: {visit: [[2, 1], [2, 9]]}}
"""


@pytest.mark.parametrize(
    ("text", "cause", "said"),
    [
        pytest.param(BETWEEN_WALLS, "unrealizable", "digit", id="between walls"),
        pytest.param(NO_DETOUR, "no_capable_robot", "push", id="no detour"),
        pytest.param(WAIT_FOR_EACH_OTHER, "cyclic_requests", "", id="waiting for each other"),
        pytest.param(FACE_TO_FACE, "deadlock", "deadlock; none of the", id="face to face"),
    ],
)
def test_an_operator_is_needed_where_no_way_is_left(text: str, cause: str, said: str) -> None:
    outcome = play(text).outcome
    assert (outcome["outcome"], outcome["cause"]) == ("operator_needed", cause)
    assert said in outcome["explanation"]
