"""Specifications as structuredslugs text, and the formulas that families have in common."""

from collections.abc import Sequence

SECTIONS = (
    "INPUT",
    "OUTPUT",
    "ENV_INIT",
    "SYS_INIT",
    "ENV_TRANS",
    "SYS_TRANS",
    "ENV_LIVENESS",
    "SYS_LIVENESS",
)


def specification(title: str, **sections: Sequence[str]) -> str:
    blocks = [f"# {title}\n"]
    blocks += [
        f"[{name}]\n" + "".join(f"{line}\n" for line in sections[name])
        for name in SECTIONS
        if sections.get(name)
    ]
    return "\n".join(blocks)


def all_of(parts: Sequence[str]) -> str:
    return "(" + " & ".join(parts) + ")"


def any_of(parts: Sequence[str]) -> str:
    return "(" + " | ".join(parts) + ")"


def code(name: str, bits: int, value: int, prime: str = "") -> str:
    """That the bits name0, name1, ... (least first) stand for the value."""
    return all_of([f"{'' if value >> b & 1 else '!'}{name}{b}{prime}" for b in range(bits)])


def move(before: str, after: str) -> str:
    return f"{before} -> {after}"
