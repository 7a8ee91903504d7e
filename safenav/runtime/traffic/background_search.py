"""Searches in a thread, for worlds with a running clock: a mission receives events, interventions
and signals during the search for a plan. Until the result is available no robot begins a step.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from threading import get_ident
from typing import TYPE_CHECKING, Any, TypeVar

from safenav.runtime.termination import Stop
from safenav.runtime.traffic import budgets

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

Answer = TypeVar("Answer")


class Unknown(Exception):  # noqa: N818 - it is not an error
    """The result is not available yet: ask again later."""


class BackgroundSearch:
    """Runs one search at a time. ``background``: whether in a thread; asking before the result is
    available then raises Unknown."""

    def __init__(self, stop: Stop) -> None:
        self.background = False
        self._stop = stop
        self._pool: ThreadPoolExecutor | None = None
        self._asked: tuple[Hashable, Future[Any]] | None = None
        self._abandoned = False
        self._thread: int | None = None
        self._told = False

    def check(self) -> None:
        """Raise RunEnded if the run must end now, and Unknown in an abandoned search."""
        self._stop.check()
        if self._abandoned and get_ident() == self._thread:
            raise Unknown

    def fresh(self) -> bool:
        """Return whether a result has become available; True only once per result."""
        come = not self._told and self._asked is not None and self._asked[1].done()
        self._told |= come
        return come

    def ask(self, moment: Hashable, search: Callable[[], Answer]) -> Answer:
        """Return the result of the search for a ``moment``; results for other moments are
        discarded. Raises Unknown, and the exceptions of the search."""
        if not self.background:
            return search()
        if self._asked is not None and self._asked[0] != moment and not self._asked[1].done():
            self._abandoned = True
            raise Unknown
        if self._asked is None or self._asked[0] != moment:
            from concurrent.futures import ThreadPoolExecutor  # only live runs need it

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
        """Abandon the running search."""
        self._abandoned = True
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _searched(self, search: Callable[[], Answer]) -> Answer:
        self._thread = get_ident()
        return search()
