"""Values of a proof, which is plain JSON: each has the expected form, or a MalformedError is
raised."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.audit.proofs.moment import Pose

_HEADINGS = ("north", "east", "south", "west")


class MalformedError(Exception):
    """A proof that lacks something, or has a value of another form."""


def mapping(value: object, what: str) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        raise MalformedError(f"{what} must be an object")
    return value


def sequence(value: object, what: str) -> list[object]:
    if not isinstance(value, list | tuple):
        raise MalformedError(f"{what} must be a list")
    return list(value)


def names(value: object, what: str) -> list[str]:
    listed = sequence(value, what)
    for name in listed:
        if not isinstance(name, str):
            raise MalformedError(f"{what} must be a list of names")
    return [str(name) for name in listed]


def whole(value: object, what: str) -> int:
    if type(value) is not int or value < 0:
        raise MalformedError(f"{what} must be a whole number from 0")
    return value


def pose(value: object, what: str) -> Pose:
    pair = sequence(value, what)
    if len(pair) != 2:
        raise MalformedError(f"{what} must be a region and a heading")
    region, heading = pair
    if heading is not None and heading not in _HEADINGS:
        raise MalformedError(f"{what} must have a heading or null")
    return whole(region, what), None if heading is None else str(heading)


def poses(value: object, what: str) -> frozenset[Pose]:
    return frozenset(pose(one, what) for one in sequence(value, what))
