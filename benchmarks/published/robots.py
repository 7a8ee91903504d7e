"""Robots among others.

- `bunny`: a robot with very many goals and a turtle that crosses its field (Filippidis, Murray and
  Holzmann: A multi-paradigm language for reactive synthesis, SYNT 2015).
- `belief`: a robot that delivers while it evades adversaries out of sight (after the belief maps of
  safe locomotion planning, in which there is one adversary).
"""

from published.text import all_of, specification


def bunny(size: int = 4) -> str:
    """A robot visits every cell of two opposite sides of its field; a turtle is in the way.

    The turtle walks back and forth in one direction and appears anywhere in the other.  Both are
    processes of the language of the paper, and have what its translation gives a process: the
    number of its action in one turn is a variable; its place in its program (one place, as it
    repeats one choice) and whose turn it is among its side's processes (of which there is one;
    before the first turn that is open) are two more.
    """
    if size < 2:
        raise ValueError("a field has at least two cells a side")
    turtle = ("(turn' = 0 & yt = yt' + 1)", "(turn' = 1 & yt' = yt + 1)", "turn' = 2")
    walk = ("(go' = 0 & x = x' + 1)", "(go' = 1 & x' = x + 1)")
    walk += ("(go' = 2 & y = y' + 1)", "(go' = 3 & y' = y + 1)", "go' = 4")
    others = ("another_of_theirs", "another_of_ours")
    return specification(
        f"a robot with {2 * size} goals and a turtle",
        INPUT=["turn:0...5", "place_of_turtle", f"xt:1...{size - 1}", f"yt:0...{size}", *others],
        OUTPUT=["place_of_robot", f"x:0...{size}", f"y:0...{size}", "go:0...5"],
        ENV_INIT=["yt = 0", "!place_of_turtle"],
        SYS_INIT=["x = 0", "y = 0", "!place_of_robot"],
        ENV_TRANS=[
            "turn' = 0 | turn' = 1 | yt' = yt",
            " | ".join(turtle),
            *(f"!{name}'" for name in ("place_of_turtle", *others)),
        ],
        SYS_TRANS=[
            "go' = 2 | go' = 3 | y' = y",
            "go' = 0 | go' = 1 | x' = x",
            " | ".join(walk),
            "!(x = xt & y = yt)",
            "!(xt' = x & yt' = y)",
            "!place_of_robot'",
        ],
        ENV_LIVENESS=["yt = 0"],
        SYS_LIVENESS=[f"x = {side} & y = {row}" for side in (0, size) for row in range(size)],
    )


def belief(rows: int = 7, cols: int = 13, adversaries: int = 1, sight: int = 3) -> str:
    """A robot delivers on a map while it evades adversaries that it sees only when they are near.

    Like the belief maps in safe locomotion planning: one integer for each robot's cell,
    and for each adversary's cell or that it is out of sight; what an adversary may do is listed
    for each pair of cells.  It is out of sight infinitely often.
    """
    cells = range(rows * cols)
    unseen = rows * cols
    border = {c for c in cells if c // cols in (0, rows - 1) or c % cols in (0, cols - 1)}
    free = [c for c in cells if c not in border]
    if len(free) < 4:
        raise ValueError("the map has no four cells inside its border")

    def near(a: int, b: int) -> int:
        return max(abs(a // cols - b // cols), abs(a % cols - b % cols))

    def steps(c: int) -> list[int]:
        return [d for d in (c, c - 1, c + 1, c - cols, c + cols) if d in free]

    env_trans = []
    for k in range(adversaries):
        for robot in free:
            seen = [c for c in free if near(robot, c) <= sight]
            edge = [c for c in seen if any(near(robot, d) > sight for d in steps(c))]
            for c in seen:
                targets = [d if d in seen else unseen for d in steps(c)]
                choice = " | ".join(f"st{k}' = {d}" for d in dict.fromkeys(targets))
                env_trans.append(f"(s = {robot} & st{k} = {c}) -> ({choice})")
            for c in free:
                if c not in seen:
                    env_trans.append(f"(s = {robot} & st{k} = {c}) -> st{k}' = {unseen}")
            choice = " | ".join(f"st{k}' = {d}" for d in [unseen, *edge])
            env_trans.append(f"(s = {robot} & st{k} = {unseen}) -> ({choice})")
        env_trans += [f"st{k}' != {c}" for c in sorted(border)] + [f"go = 0 -> st{k}' != s"]
    env_trans += [
        "go = 0 -> (orientation' = orientation & s' = s)",
        f"go = 1 -> (orientation' = 0 & s' + {cols} = s)",
        "go = 2 -> (orientation' = 1 & s' = s + 1)",
        f"go = 3 -> (orientation' = 2 & s' = s + {cols})",
        "go = 4 -> (orientation' = 3 & s' + 1 = s)",
    ]
    first, last = free[0], free[-1]
    sys_trans = [f"orientation' = {k} -> go' != {back}" for k, back in enumerate((3, 4, 1, 2))]
    sys_trans += [
        f"(orientation = {k} & go = 0) -> (go' = 0 | go' = {k + 1})" for k in range(4)
    ] + [f"s' != {c}" for c in sorted(border)]
    for number, (goal, condition) in enumerate(
        ((last, "order"), (first, f"s = {last} & pending0"))
    ):
        sys_trans += [
            f"s = {goal} -> !pending{number}'",
            f"s != {goal} -> (pending{number}' <-> (pending{number} | ({condition})))",
        ]
    for k in range(adversaries):
        sys_trans += [f"st{k}' = {c} -> (s' != {c} & s != {c})" for c in free]
    return specification(
        f"deliveries on {rows} x {cols} cells, {adversaries} adversaries, sight {sight}",
        INPUT=[
            *(f"st{k}:0...{unseen}" for k in range(adversaries)),
            "orientation:0...3",
            f"s:0...{unseen - 1}",
            "order",
        ],
        OUTPUT=["go:0...4", "pending0", "pending1"],
        ENV_INIT=[f"s = {first}", "orientation = 1", "order"]
        + [f"st{k} = {unseen}" for k in range(adversaries)],
        SYS_INIT=["go = 0", "!pending0", "!pending1"],
        ENV_TRANS=env_trans,
        SYS_TRANS=sys_trans,
        ENV_LIVENESS=[all_of([f"st{k}' = {unseen}" for k in range(adversaries)])],
        SYS_LIVENESS=["!pending0", "!pending1"],
    )
