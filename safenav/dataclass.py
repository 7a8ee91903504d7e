"""Dataclasses that are quick to define: same data, same behaviour, compiled when first used.

The standard library writes six methods for each frozen dataclass as text and compiles them
together. A run defines two hundred classes before it begins, and that was a third of its start.
Here a method that must be fast is compiled when it is called for the first time, and the others are
closures.

    from safenav.dataclass import dataclass

    @dataclass(frozen=True)
    class Place: ...

``fields``, ``replace``, ``field`` and pattern matching work as with the standard library's
decorator, which collects the fields here, too; ``inspect.signature`` knows the parameters from
the first instance on. Classes with slots or an order use the standard library's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError, fields
from dataclasses import dataclass as _collected
from reprlib import recursive_repr
from sys import modules
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # what type checkers are to take it for
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True):
        """Make a class a dataclass; with or without arguments, as the standard library's."""

        def made(plain):
            return _made(plain, frozen=frozen, eq=eq)

        return made if cls is None else made(cls)


_all: list[Callable[[], object]] = []


def compile_all() -> None:
    """Compile the methods of all classes now: for a process that copies of itself are made of."""
    while _all:
        _all.pop()()


def _made(plain: type, *, frozen: bool, eq: bool) -> Any:
    if not plain.__doc__:  # else the standard library works out a signature to put there
        plain.__doc__ = plain.__name__
    cls: Any = _collected(init=False, repr=False, eq=False)(plain)
    own = cls.__dict__
    if "__init__" not in own:
        cls.__init__ = _at_first_call(cls, "__init__", _init)
    if "__repr__" not in own:
        cls.__repr__ = _repr
    if eq:
        explicit = own.get("__hash__") is not None
        if "__eq__" not in own:
            cls.__eq__ = _at_first_call(cls, "__eq__", _eq)
        if not explicit:
            cls.__hash__ = _at_first_call(cls, "__hash__", _hash) if frozen else None
    if frozen:
        names = frozenset(cls.__dataclass_fields__)
        cls.__setattr__ = _refuse(cls, names, "assign to", cls.__setattr__)
        cls.__delattr__ = _refuse(cls, names, "delete", cls.__delattr__)
    return cls


def _at_first_call(cls: Any, name: str, write: Callable[[Any, dict[str, Any]], str]) -> Any:
    """A method that becomes another when it is called: ``write`` gives its text after the name,
    and into the dictionary the names that the text uses."""

    def compiled() -> Any:
        given: dict[str, Any] = {}
        text = write(cls, given)
        scope: dict[str, Any] = {}
        text = f"def made({', '.join(given)}):\n def {name}{text}\n return {name}"
        exec(text, modules[cls.__module__].__dict__, scope)
        method = scope["made"](**given)
        method.__qualname__ = f"{cls.__qualname__}.{name}"
        if name == "__init__":
            types = {f.name: f.type for f in fields(cls) if f.init}
            method.__annotations__ = {**types, "return": None}
        setattr(cls, name, method)
        return method

    def first(self: Any, /, *args: Any, **named: Any) -> Any:
        return compiled()(self, *args, **named)

    _all.append(compiled)
    first.__name__ = name
    first.__qualname__ = f"{cls.__qualname__}.{name}"
    return first


def _init(cls: Any, given: dict[str, Any]) -> str:
    given |= {"_set": object.__setattr__, "_absent": MISSING}
    parameters, named, body = ["self"], ["*"], []
    for f in fields(cls):
        parameter = value = f.name
        if f.default_factory is not MISSING:
            given[f"_{f.name}"] = f.default_factory
            value = f"_{f.name}()"
            if f.init:
                parameter += "=_absent"
                value += f" if {f.name} is _absent else {f.name}"
        elif f.default is not MISSING:
            given[f"_{f.name}"] = f.default
            parameter += f"=_{f.name}"
        if f.init:
            (named if f.kw_only else parameters).append(parameter)
        if f.init or f.default_factory is not MISSING:
            body.append(f"_set(self, {f.name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    if len(named) > 1:
        parameters += named
    return f"({', '.join(parameters)}): {'; '.join(body) or 'pass'}"


def _eq(cls: Any, _: dict[str, Any]) -> str:
    names = [f.name for f in fields(cls) if f.compare]
    return (
        "(self, other):\n  if other.__class__ is self.__class__: "
        f"return {_tuple('self', names)} == {_tuple('other', names)}\n  return NotImplemented"
    )


def _hash(cls: Any, _: dict[str, Any]) -> str:
    hashed = [f for f in fields(cls) if (f.compare if f.hash is None else f.hash)]
    return f"(self): return hash({_tuple('self', [f.name for f in hashed])})"


def _tuple(who: str, names: list[str]) -> str:
    return "(" + "".join(f"{who}.{name}, " for name in names) + ")"


@recursive_repr()
def _repr(self: Any) -> str:
    said = ", ".join([f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr])
    return f"{self.__class__.__qualname__}({said})"


def _refuse(cls: type, names: frozenset[str], what: str, inherited: Any) -> Any:
    """Nothing of an instance changes, and of a subclass's no field of this class."""

    def refuse(self: Any, name: str, *value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot {what} field {name!r}")
        inherited(self, name, *value)

    return refuse
