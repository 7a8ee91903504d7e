"""Searches in a thread, for worlds in which time passes meanwhile: a mission hears its world, its
operator and its signals while a plan is searched. Nobody begins a step until the answer is there,
so that the plan begins where the robots are."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import get_ident
from typing import Any, TypeVar

from safenav.runtime.termination import Stop
from safenav.runtime.traffic import budgets

Answer = TypeVar("Answer")


class Unknown(Exception):  # noqa: N818 - it is not an error
    """The answer is not there yet: ask again."""


class Thinking:
    """One search at a time. ``background``: whether in a thread; asking for an answer that is not
    there raises Unknown."""

    def __init__(self, stop: Stop) -> None:
        self.background = False
        self._stop = stop
        self._pool: ThreadPoolExecutor | None = None
        self._asked: tuple[Hashable, Future[Any]] | None = None
        self._abandoned = False
        self._thread: int | None = None
        self._told = False

    def check(self) -> None:
        """Raises RunEnded if the run must end now, and Unknown in a search that nobody awaits."""
        self._stop.check()
        if self._abandoned and get_ident() == self._thread:
            raise Unknown

    def fresh(self) -> bool:
        """Whether an answer has come, once."""
        come = not self._told and self._asked is not None and self._asked[1].done()
        self._told |= come
        return come

    def ask(self, moment: Hashable, search: Callable[[], Answer]) -> Answer:
        """The answer of a search that begins at a ``moment``: one for another moment is of no use.
        Raises Unknown, and what the search raises."""
        if not self.background:
            return search()
        if self._asked is not None and self._asked[0] != moment and not self._asked[1].done():
            self._abandoned = True
            raise Unknown
        if self._asked is None or self._asked[0] != moment:
            self._pool = self._pool or ThreadPoolExecutor(1)
            self._abandoned = self._told = False
            self._asked = moment, self._pool.submit(self._searched, search)
        future: Future[Answer] = self._asked[1]
        try:
            found = future.result(budgets.AT_ONCE)
        except TimeoutError:
            if future.done():  # the search has raised it
                raise
            raise Unknown from None
        finally:
            if future.done():
                self._asked = None
        return found

    def close(self) -> None:
        """Abandon what is searched."""
        self._abandoned = True
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _searched(self, search: Callable[[], Answer]) -> Answer:
        self._thread = get_ident()
        return search()
