"""Commands to try, and how to run them."""

import subprocess
from pathlib import Path

from children import ran

# The robot follows a light that returns infinitely often.
FOLLOW = """
[INPUT]
light: 0...2
[OUTPUT]
at: 0...2
[ENV_INIT]
light = 0
[SYS_INIT]
at = 0
[ENV_TRANS]
light' <= light + 1 & light <= light' + 1
[SYS_TRANS]
at' <= at + 1 & at <= at' + 1
[ENV_LIVENESS]
light' = 2
[SYS_LIVENESS]
at' = light'
"""
# The same, but the robot cannot move.
STUCK = FOLLOW.replace("at' <= at + 1", "at' = at").replace("at' = light'", "at' = 1")
# A counter that takes 2^30 steps to its goal, too many to wait for.
ENDLESS = """
[OUTPUT]
count: 0...1073741823
[SYS_INIT]
count = 0
[SYS_TRANS]
count' = count + 1
[SYS_LIVENESS]
count' = 1073741823
"""
# All different: the diagram has a node for each subset of the values.
CROWDED = (
    "[OUTPUT]\n"
    + "".join(f"x{i}: 0...15\n" for i in range(12))
    + "[SYS_TRANS]\n"
    + "".join(f"x{i}' != x{j}'\n" for i in range(12) for j in range(i))
)
STRATEGY = ("--explicitStrategy", "--jsonOutput")


def run(
    binary: Path, folder: Path, *arguments: str | Path, text: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run the command in the folder."""
    return ran([binary, *arguments], cwd=folder, input=text)
