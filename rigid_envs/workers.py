"""Threads that step the rows of an environment together."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.compiler import address_of, compiled_for
from rigid_envs.kernels.publication import Outputs
from rigid_envs.kernels.team import is_asleep, lead, new_board, serve, wake

__all__ = ["Workers"]

Inbox = SimpleQueue[bool]


class Workers:
    """Threads of one owner, and the one that calls.

    They start at the first step, sleep some time after the last one, and end with the owner of this
    object or with the process. After a fork the child starts threads of its own.

    Args:
        step: compiled loop of a step: see `step_loop.step_rows`.
        buffer: data of the rows.
        n_blocks: number of blocks.
        count: number of threads, the caller's included.
        outputs: arrays like those to which steps publish.
    """

    def __init__(
        self,
        step: Callable[..., int],
        buffer: npt.NDArray[np.float64],
        n_blocks: int,
        count: int,
        outputs: Outputs,
    ) -> None:
        """No thread is started yet."""
        self._step, self._buffer, self._outputs = step, buffer, outputs
        self._n_blocks, self._count = n_blocks, count
        self._inboxes: list[Inbox] = []
        self._process = 0

    def step(self, *outputs: Any) -> int:
        """Step all blocks; the bits are those of one thread.

        Args:
            *outputs: where they are published: see `publication`.

        Returns:
            What the step of all blocks returns: see `Core.step_into`.
        """
        if self._process != os.getpid():
            self._start()
        board = self._arguments[3]
        for k, inbox in enumerate(self._inboxes):
            if is_asleep(board, k):
                wake(board, k)
                inbox.put(True)
        return self._lead(*self._arguments, *outputs)

    def _start(self) -> None:
        address = address_of(self._step, self._buffer, 0, 0, *self._outputs)
        board = new_board(self._count)
        self._arguments = address, self._buffer, self._n_blocks, board, self._count
        # both now: a thread that compiles would disturb the first seconds of steps
        self._lead = compiled_for(lead, *self._arguments, *self._outputs)
        work = compiled_for(serve, *self._arguments, *self._outputs, 0)
        self._inboxes = [SimpleQueue() for _ in range(self._count - 1)]
        self._process = os.getpid()
        for k, inbox in enumerate(self._inboxes):
            arguments = (inbox, work, *self._arguments, *self._outputs, k)
            threading.Thread(target=_work, args=arguments, daemon=True).start()
        weakref.finalize(self, _end, self._inboxes)


def _work(inbox: Inbox, work: Callable[..., None], *arguments: Any) -> None:
    while inbox.get():
        work(*arguments)


def _end(inboxes: list[Inbox]) -> None:
    for inbox in inboxes:
        inbox.put(False)
