"""Threads that share the rows of an environment."""

import gc
import os
import threading
import time

import numba

from rigid_envs.workers import Workers


@numba.njit(nogil=True)
def double(x):
    return 2 * x


def threads_now():
    return set(threading.enumerate())


def waited_for(condition):
    end = time.monotonic() + 30
    while not condition() and time.monotonic() < end:
        time.sleep(0.001)
    return condition()


def test_every_call_is_made_once():
    workers = Workers(3)
    for n in (1, 2, 3, 4):
        assert sorted(workers.run(double, [(k,) for k in range(n)])) == [2 * k for k in range(n)]


def test_threads_start_with_the_first_call_and_stay():
    before = threads_now()
    workers = Workers(2)
    assert threads_now() == before
    workers.run(double, [(1,), (2,), (3,)])
    started = threads_now() - before
    assert len(started) == 2
    for _ in range(100):
        workers.run(double, [(1,), (2,), (3,)])
    assert threads_now() - before == started


def test_threads_end_with_their_owner():
    before = threads_now()
    for _ in range(50):
        Workers(2).run(double, [(1,), (2,), (3,)])
    gc.collect()
    assert waited_for(lambda: threads_now() <= before)


def test_a_result_that_was_not_waited_for_is_not_taken_for_another():
    workers = Workers(1)
    started, go_on = threading.Event(), threading.Event()

    def slow(x):
        started.set()
        go_on.wait(30)
        return x

    def interrupted(x):
        if x == 1:
            return slow(x)
        assert started.wait(30)
        raise KeyboardInterrupt

    try:
        workers.run(interrupted, [(1,), (2,)])
    except KeyboardInterrupt:
        go_on.set()
    assert sorted(workers.run(double, [(5,), (6,)])) == [10, 12]


def test_a_forked_process_has_threads_of_its_own():
    workers = Workers(1)
    workers.run(double, [(1,), (2,)])
    child = os.fork()
    if child == 0:
        os._exit(0 if sorted(workers.run(double, [(1,), (2,)])) == [2, 4] else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert sorted(workers.run(double, [(3,), (4,)])) == [6, 8]
