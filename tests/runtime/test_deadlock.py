"""Joint plans of robots that wait for each other; others are ``cases/shared_floor``."""

from once import SCENARIOS
from runtime.played import completed


def test_robots_swap_in_a_corridor_by_joint_plans() -> None:
    text = (SCENARIOS / "corridor_swap.yaml").read_text()
    trace = completed(text)
    plans = trace.all("plan")
    assert plans and [end["reason"] for end in trace.all("plan_end")] == ["reached"] * len(plans)
    assert all(any(len(way) > 1 for way in plan["robots"].values()) for plan in plans)


def test_robots_with_headings_enter_a_corridor_in_one_direction_at_a_time() -> None:
    # Robots with heading mobility could not back out of it.
    trace = completed("""
        map:
          grid: |
            #############
            #...#####...#
            #...........#
            #...#####...#
            #############
        robots:
          a: {model: digit, start: [2, 1], heading: east, objective: {visit: [[1, 11], [1, 1]]}}
          b: {model: digit, start: [3, 11], heading: west, objective: {visit: [[3, 1], [3, 11]]}}
        """)
    corridor = set(range(2 * 13 + 4, 2 * 13 + 9))
    inside: dict[str, int] = {}
    for move in trace.all("move"):
        inside[move["robot"]] = move["to"]
        both = [region for region in inside.values() if region in corridor]
        if len(both) == 2:  # one behind the other, never head-on
            headings = {
                m["heading"] for m in trace.all("move", tick=move["tick"]) if m["to"] in corridor
            }
            assert len(headings) == 1


def test_joint_plans_respect_the_memory_of_formulas() -> None:
    """To be back at the west end after having been further east: places alone do not say whether
    that is met, so a plan takes the robot where its strategy is going."""
    trace = completed("""
        map: {grid: ["#########", "#.......#", "####.####", "#########"]}
        robots:
          a:
            model: quadcopter
            start: [1, 1]
            objective:
              ltl:
                memory: {seen: bool}
                init: "!seen"
                safety: ["seen' <-> (seen & region != 10) | region = 15"]
                liveness: ["seen & region = 10"]
          b:
            model: quadcopter
            start: [1, 7]
            objective: {ltl: {liveness: ["region = 11", "region = 16"]}}
        """)
    assert trace.all("plan")
    path = trace.path("a")
    assert 10 in path[path.index(15) :]
    assert trace.all("goal", robot="a")[0]["tick"] > path.index(15)
