"""Threads that run compiled functions side by side, parked between calls."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Any

__all__ = ["Workers"]

Job = tuple[Callable[..., int], tuple[Any, ...], "SimpleQueue[int]"]
Inbox = SimpleQueue[Job | None]


class Workers:
    """Threads of one owner.

    They start at the first call, sleep between calls, and end with the owner of this object or with
    the process. After a fork the child starts threads of its own.

    Args:
        count: number of threads beside the caller's.
    """

    def __init__(self, count: int) -> None:
        """No thread is started yet."""
        self._count = count
        self._inboxes: list[Inbox] = []
        self._process = 0

    def run(self, function: Callable[..., int], calls: Sequence[tuple[Any, ...]]) -> list[int]:
        """Results of a function that raises nothing, for several arguments at once.

        Args:
            function: compiled, so that it does not hold the interpreter lock.
            calls: arguments of every call, at most one more than there are threads; the last one
                is made by the caller.
        """
        if self._process != os.getpid():
            self._start()
        results: SimpleQueue[int] = SimpleQueue()  # a new one: an interrupted call leaves some
        for inbox, arguments in zip(self._inboxes, calls[:-1], strict=False):
            inbox.put((function, arguments, results))
        own = function(*calls[-1])
        return [own, *(results.get() for _ in calls[:-1])]

    def _start(self) -> None:
        self._inboxes = [SimpleQueue() for _ in range(self._count)]
        self._process = os.getpid()
        for inbox in self._inboxes:
            threading.Thread(target=_work, args=(inbox,), daemon=True).start()
        weakref.finalize(self, _end, self._inboxes)


def _work(inbox: Inbox) -> None:
    while (job := inbox.get()) is not None:
        function, arguments, results = job
        results.put(function(*arguments))
        del job, function, arguments, results  # what is left of the last job must not live on


def _end(inboxes: list[Inbox]) -> None:
    for inbox in inboxes:
        inbox.put(None)
