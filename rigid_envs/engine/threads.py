"""Threads that step the rows of a core together."""

import os
import platform
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import Signature

from rigid_envs.base.checks import Bools
from rigid_envs.engine.compiler import address_of, compiled_for, instruction, kernel, phase
from rigid_envs.engine.layout import Buffer
from rigid_envs.engine.publication import Observations, Outputs, Results

# Threads that share the blocks of a step, without the interpreter's lock.
#
# To wake a thread that sleeps takes as long as a step of some thousand rows. A thread that has
# worked therefore looks for some time whether there is more to do, and sleeps only then. The thread
# that leads a step takes the share of each that is not there in time: it waits for none to wake up.
#
# What they share is in a *board* of integers, each in a cache line of its own: the next share, how
# many are at work, where to publish, which sleep, and what a share returned.

Board = npt.NDArray[np.int64]


_LINE = 8  # integers in a cache line
_NEXT, _AT_WORK, _OUTPUTS = 0, _LINE, 2 * _LINE
_SHARES = 3 * _LINE  # of share k: what it returned, whether thread k sleeps
_PATIENCE = 4000  # looks for work before a thread sleeps, 0.1 to 0.2 ms


def new_board(n_shares: int) -> Board:
    """A board without work, all asleep."""
    board = np.zeros(_SHARES + n_shares * _LINE, dtype=np.int64)
    board[_NEXT] = n_shares
    board[_SHARES + 1 :: _LINE] = 1
    return board


def is_asleep(board: Board, k: int) -> bool:
    """Whether thread k sleeps, or is about to."""
    return bool(board.item(_SHARES + k * _LINE + 1))


def wake(board: Board, k: int) -> None:
    """Note that thread k is being woken."""
    board[_SHARES + k * _LINE + 1] = 0


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Pointer to ``board[k]``."""
    data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
    return builder.gep(data, [arguments[1]])


@instruction
def _read(_context: Any, board: Any, k: Any) -> tuple[Signature, Callable[..., Any]]:
    """``board[k]``, as other threads have left it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, signature, arguments)
        return builder.load_atomic(place, "seq_cst", 8)

    return types.int64(board, types.intp), generate


@instruction
def _write(_context: Any, board: Any, k: Any, value: Any) -> tuple[Signature, Callable[..., Any]]:
    """Set ``board[k]``, after all that was written before."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, signature, arguments)
        builder.store_atomic(arguments[2], place, "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(board, types.intp, types.int64), generate


@instruction
def _add(_context: Any, board: Any, k: Any, value: Any) -> tuple[Signature, Callable[..., Any]]:
    """Add to ``board[k]``; returns what it was."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, signature, arguments)
        return builder.atomic_rmw("add", place, arguments[2], "seq_cst")

    return types.int64(board, types.intp, types.int64), generate


@instruction
def _pause(_context: Any) -> tuple[Signature, Callable[..., Any]]:
    """Tell an x86 processor that the thread waits for another, which may share its core."""

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        if platform.machine() in ("x86_64", "AMD64"):
            kind = ir.FunctionType(ir.VoidType(), [])
            name = "llvm.x86.sse2.pause"
            builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [])
        return context.get_dummy_value()

    return types.void(), generate


@instruction
def _at(_context: Any, array: Any, address: Any) -> tuple[Signature, Callable[..., Any]]:
    """An array like another, whose data are at an address; nobody frees them."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        like = context.make_array(array)(context, builder, arguments[0])
        like.data = builder.inttoptr(arguments[1], like.data.type)
        like.meminfo = cgutils.get_null_value(like.meminfo.type)
        return like._getvalue()

    return array(array, types.int64), generate


@instruction
def _call(
    _context: Any,
    address: Any,
    buffer: Any,
    first: Any,
    last: Any,
    results: Any,
    observations: Any,
    flags: Any,
) -> tuple[Signature, Callable[..., Any]]:
    """Call the machine code of a step at an address; it raises nothing."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        result, given, convention = signature.return_type, signature.args[1:], context.call_conv
        kind = convention.get_function_type(result, given).as_pointer()
        function = builder.inttoptr(arguments[0], kind)
        _, value = convention.call_function(builder, function, result, given, arguments[1:])
        return value

    blocks = types.int64, types.int64
    return types.int64(types.int64, buffer, *blocks, results, observations, flags), generate


@phase
def _take_shares(
    address: int,
    buffer: Buffer,
    n_blocks: int,
    board: Board,
    n_shares: int,
    results: Results,
    observations: Observations,
    flags: Bools,
) -> None:
    """Step shares that nobody has taken, until there is none.

    Outputs are arrays like those to which they are published, at the addresses on the board.
    """
    k = _add(board, _NEXT, 1)
    while k < n_shares:
        first, last = n_blocks * k // n_shares, n_blocks * (k + 1) // n_shares
        board[_SHARES + k * _LINE] = _call(
            address,
            buffer,
            first,
            last,
            _at(results, board[_OUTPUTS]),
            _at(observations, board[_OUTPUTS + 1]),
            _at(flags, board[_OUTPUTS + 2]),
        )
        k = _add(board, _NEXT, 1)


@kernel
def lead(
    address: int,
    buffer: Buffer,
    n_blocks: int,
    board: Board,
    n_shares: int,
    results: Results,
    observations: Observations,
    flags: Bools,
) -> int:
    """Step all blocks, with the threads that serve.

    Args:
        address: Of the machine code of a step: see `step_loop.step_rows`.
        buffer: Data of the rows.
        n_blocks: Number of blocks.
        board: From `new_board`.
        n_shares: Number of shares.
        results: To which the rows are published.
        observations: To which the rows are published.
        flags: To which the rows are published.

    Returns:
        The sum of what the shares returned; a negative one if there is one.
    """
    board[_OUTPUTS] = results.ctypes.data
    board[_OUTPUTS + 1] = observations.ctypes.data
    board[_OUTPUTS + 2] = flags.ctypes.data
    _write(board, _NEXT, 0)
    _take_shares(address, buffer, n_blocks, board, n_shares, results, observations, flags)
    while _read(board, _AT_WORK) > 0:
        _pause()
    total = 0
    for k in range(n_shares):
        result: int = board[_SHARES + k * _LINE]
        if result < 0:
            return result
        total += result
    return total


@kernel
def serve(
    address: int,
    buffer: Buffer,
    n_blocks: int,
    board: Board,
    n_shares: int,
    results: Results,
    observations: Observations,
    flags: Bools,
    me: int,
) -> None:
    """Take shares of steps, until there has been none for some time.

    Args:
        address: As in `lead`; and so are the others.
        buffer: Data of the rows.
        n_blocks: Number of blocks.
        board: From `new_board`.
        n_shares: Number of shares.
        results: An array like that to which rows are published.
        observations: An array like that to which rows are published.
        flags: An array like that to which rows are published.
        me: Number of this thread.
    """
    n_looks = 0
    while n_looks < _PATIENCE:
        n_looks += 1
        _pause()
        if _read(board, _NEXT) < n_shares:
            _add(board, _AT_WORK, 1)
            _take_shares(address, buffer, n_blocks, board, n_shares, results, observations, flags)
            _add(board, _AT_WORK, -1)
            n_looks = 0
    _write(board, _SHARES + me * _LINE + 1, 1)


# Threads that step the rows of an environment together.

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
