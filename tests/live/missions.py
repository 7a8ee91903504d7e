"""Random missions for runs in time: room crowds with doors, of 2 to 20 robots, and labs."""

from pathlib import Path
from random import Random

import yaml

from campaigns.generate.build import Data, Draft, rooms
from campaigns.generate.families import mission

KINDS = ("visit", "visit", "cover", "patrol", "hold")
SIZES = (2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 8, 8, 10, 12, 16, 20)


def former(name: str) -> Data | None:
    """A mission in which a defect was found, whatever its seed gives now."""
    file = Path(__file__).parent / "cases" / f"{name}.yaml"
    return yaml.safe_load(file.read_text()) if file.exists() else None


def timed(seed: int) -> Data:
    """The mission with this seed: six of ten are crowds of a size that goes round."""
    if (found := former(f"timed_{seed}")) is not None:
        return found
    if seed % 5 < 3:
        return crowd(seed, SIZES[seed // 5 % len(SIZES)])
    family = "labs" if seed % 5 == 3 else "tight_hidden"
    for again in range(100):
        data = mission(family, 1000 * again + seed)
        passing = any({"from", "until"} & one.keys() for one in data.get("obstacles", []))
        if len(data["robots"]) > 1 and not passing:
            return data
    raise AssertionError(f"no mission of {family} for {seed}")


def crowd(seed: int, count: int) -> Data:
    """A number of robots in rooms with doors one region wide, some closed; every fifth flies."""
    random = Random(f"timed crowd {seed} {count}")
    while True:
        down, across = (1, 2) if count < 4 else (2, 2) if count < 10 else (2, 3)
        grid = rooms(random, down, across, random.randint(3, 4), random.randint(3, 5))
        draft = Draft(random, grid, f"crowd of {count}, {seed}")
        draft.models["rover"] = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
        draft.models["cart"] = {"mobility": "free", "layer": "ground"}
        taken: set[int] = set()
        for k in range(count):
            model = (
                "quadcopter" if k % 5 == 4 else random.choice(["digit", "rover", "rover", "cart"])
            )
            draft.place(f"{model}{k}", model, KINDS, taken)
        doors = draft.narrow()
        for region in random.sample(doors, min(len(doors), random.randint(0, 3))):
            draft.obstacle(random.choice(["door", "door", "uncertainty"]), region)
        if len(draft.robots) == count:
            return draft.data(1, 4000, seed)
