"""Threads that share the rows of an environment."""

import gc
import os
import threading
import time

import numba
import numpy as np
import pytest

from rigid_envs.engine.threads import Workers, _read, _write, is_asleep


@numba.njit(nogil=True)
def count(buffer, first, last, results, observations, flags):
    for k in range(first, last):
        buffer[k] += 1.0
        results[0, k] = observations[k, 0] = buffer[k]
        flags[0, k] = True
    return last - first


@numba.njit(nogil=True)
def refuse(buffer, first, last, results, observations, flags):
    return -7 if last == len(buffer) else 3


@numba.njit(nogil=True)
def meet(buffer, first, last, results, observations, flags):
    """1 if all shares of one block are under way at the same time, which takes as many threads."""
    under_way = buffer.view(np.int64)
    _write(under_way, first, 1)
    for _ in range(100_000):
        count = 0
        for k in range(len(under_way)):
            count += _read(under_way, k)
        if count == len(under_way):
            return 1
    return 0


def team(n_blocks=6, n_threads=3, step=count):
    return Workers(step, np.zeros(n_blocks), n_blocks, n_threads, outputs_of(n_blocks))


def outputs_of(n):
    return np.zeros((1, n)), np.zeros((n, 1), np.float32), np.zeros((1, n), np.bool_)


def stepped(workers):
    """A step that publishes to arrays of its own."""
    return workers.step(*outputs_of(len(blocks_of(workers))))


def blocks_of(workers):
    return workers._buffer


def threads_now():
    return set(threading.enumerate())


def waited_for(condition):
    end = time.monotonic() + 30
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.001)
    return holds


def all_sleep(workers):
    board = workers._arguments[3]
    return all(is_asleep(board, k) for k in range(len(workers._inboxes)))


@pytest.mark.parametrize("n_threads", [1, 2, 3, 4])
@pytest.mark.parametrize("n_blocks", [4, 5, 64])
def test_every_block_is_stepped_once(n_threads, n_blocks):
    workers = team(n_blocks, n_threads)
    for k in range(2000):
        assert stepped(workers) == n_blocks
        assert (blocks_of(workers) == k + 1).all()


def test_every_step_is_published_to_the_arrays_that_it_is_given():
    workers, kept = team(n_blocks=64), []
    for _ in range(200):
        kept.append(outputs_of(64))
        workers.step(*kept[-1])
    for k, (results, observations, flags) in enumerate(kept):
        assert (results == k + 1).all() and (observations == k + 1).all() and flags.all()


def test_threads_that_fall_asleep_wake_up():
    workers = team()
    for k in range(20):
        assert stepped(workers) == 6 and (blocks_of(workers) == k + 1).all()
        assert waited_for(lambda: all_sleep(workers))


def test_shares_run_side_by_side():
    workers = team(n_blocks=3, step=meet)

    def all_met():
        blocks_of(workers)[:] = 0.0
        return stepped(workers) == 3

    assert waited_for(all_met)  # threads that come late are not waited for


def test_a_refusal_of_one_share_is_that_of_all():
    workers = team(step=refuse)
    assert [stepped(workers) for _ in range(100)] == [-7] * 100


def test_threads_start_with_the_first_step_and_stay():
    before = threads_now()
    workers = team()
    assert threads_now() == before
    stepped(workers)
    started = threads_now() - before
    assert len(started) == 2
    for _ in range(100):
        stepped(workers)
    assert threads_now() - before == started


def test_threads_end_with_their_owner():
    before = threads_now()
    for _ in range(50):
        stepped(team())
    gc.collect()
    assert waited_for(lambda: threads_now() <= before)


def test_a_forked_process_has_threads_of_its_own():
    workers = team()
    assert stepped(workers) == 6
    child = os.fork()
    if child == 0:
        os._exit(0 if stepped(workers) == 6 and (blocks_of(workers) == 2).all() else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert stepped(workers) == 6 and (blocks_of(workers) == 2).all()
