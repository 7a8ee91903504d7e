"""Teams in narrow places, where patrols by the letter and objectives among others often fail."""

from random import Random

from campaigns.generate.build import Data, Draft, corridor, open_floor, rooms, scattered

KINDS = ("patrol", "patrol", "patrol", "visit", "cover", "hold", "ltl_steps")


def narrow(seed: int) -> Data:
    """The team with this seed; ``form: literal`` for some patrols. No hidden obstacles."""
    random = Random(f"narrow {seed}")
    while True:
        data = _team(random, seed)
        if data is not None:
            return data


def _team(random: Random, seed: int) -> Data | None:
    match random.randrange(4):
        case 0:
            grid = open_floor(1, random.randint(3, 7))
        case 1:
            grid = corridor(random, random.randint(3, 7))
        case 2:
            grid = rooms(random, 1, 2, random.randint(1, 2), random.randint(1, 3))
        case _:
            grid = scattered(random, random.randint(2, 4), random.randint(2, 5), 0.3)
    draft = Draft(random, grid, f"narrow {seed}")
    count = random.choice([1, 1, 2, 2, 3])
    if len(draft.free) < count + 2:
        return None
    taken: set[int] = set()
    for k in range(count):
        layer = "ground" if random.random() < 0.7 else "air"
        mobility = "heading" if random.random() < 0.3 else "free"
        draft.models[f"m{k}"] = {"mobility": mobility, "layer": layer}
        more: Data = {}
        if random.random() < 0.2:
            more["avoids"] = []
        if random.random() < 0.3:
            more["tracking"] = random.choice(["exact", "belief"])
            more["vision"] = random.choice([1, 2, "unlimited"])
        if not draft.place(f"r{k}", f"m{k}", KINDS, taken, **more):
            return None
    for robot in draft.robots.values():
        if "patrol" in robot["objective"] and random.random() < 0.3:
            robot["objective"]["form"] = "literal"
    data = draft.data(1, 3, seed)
    if random.random() < 0.15:
        data["coordination"] = "assignable"
    return data
