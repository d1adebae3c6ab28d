"""Rows of a task, and threads that share them: steps, results, states, and what is refused."""

import gc
import multiprocessing
import threading
import time

import numba
import numpy as np
import pytest

from rigid_envs.engine.layout import FLAGS
from rigid_envs.engine.rows import LANES
from rigid_envs.engine.threads import Workers, _read, _write, is_asleep, new_board, wake
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.core import Core
from rigid_envs.testing.environments import IDS, task_of

SIZES = (1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5)


@pytest.fixture(params=IDS)
def task(request):
    return task_of(request.param)


def begun(task, n, **settings):
    """Rows that have begun an episode, row i with the key i."""
    core = Core(task, n, **settings)
    rows = np.arange(n)
    core.seed(rows, rows.astype(np.uint64))
    core.reset(rows)
    return core


def act(core, seed=0):
    """A step under random actions."""
    rng, shape = np.random.default_rng(seed), (1000, core.actions.shape[1])
    n_choices = core.task.n_choices
    actions = rng.integers(0, n_choices, shape) if n_choices else rng.uniform(-1, 1, shape)
    core.actions[...] = actions[: core.n_rows]
    return core.step()


@pytest.mark.parametrize("n", SIZES)
def test_blocks_begin_at_a_cache_line(n):
    core = Core(BallPark(), n)
    assert core._blocks.ctypes.data % 64 == 0


def test_every_part_has_an_entry_for_every_row_and_no_more(task):
    for n in SIZES:
        core = begun(task, n)
        act(core)
        assert core.actions.shape == (n, len(task.actions()))
        assert core.observations.shape == (n, len(task.observations()))
        assert core.y.shape == (n, len(task.system_type.state_entries))
        n_results = 2 + len(task.terms) + len(task.episode.ground.names)
        assert core.results.shape == (n_results, n)
        assert core.flags.shape == (len(FLAGS), n)
        assert core.elapsed.tolist() == [1.0] * n
        assert core.running.all()
        assert all(part.shape[0] == n for part in core.get_state().values())


def test_threads_are_made_anew_in_a_forked_process():
    core = begun(BallPark(), 5 * LANES, n_threads=2)
    act(core)
    ours, theirs = multiprocessing.Pipe()

    def child():
        act(core, 1)
        theirs.send_bytes(core.observations.tobytes())

    process = multiprocessing.get_context("fork").Process(target=child, daemon=True)
    process.start()
    act(core, 1)
    assert ours.poll(30), "the forked process does not step"
    assert ours.recv_bytes() == core.observations.tobytes()
    process.join(30)
    assert process.exitcode == 0


@pytest.mark.parametrize("n_threads", [1, 2])
def test_step_tells_whether_any_flag_is_up(n_threads):
    n = 3 * LANES
    core = begun(BallPark(position_tolerance=1.0), n, max_steps=9, n_threads=n_threads)
    for k in range(9):
        raised = act(core, k)
        terminated, truncated = core.flags[:2]
        assert (raised > 0) == core.flags.any()
        np.testing.assert_array_equal(core.running, ~(terminated | truncated))
    assert truncated.all()


def test_renewed_outputs_have_the_same_content_in_memory_of_their_own(task):
    for n in SIZES:
        core = begun(task, n)
        act(core)
        old = core.outputs
        core.renew_outputs()
        for part, same in zip(old, core.outputs, strict=True):
            assert (part.dtype, part.shape, part.tobytes()) == (
                same.dtype,
                same.shape,
                same.tobytes(),
            )
            assert not np.shares_memory(part, same)


def test_a_moment_is_the_row_after_its_last_step_and_has_no_results_after_a_reset(task):
    core, row = begun(task, LANES + 2), LANES + 1
    for n_steps in range(3):
        moment = core.moment(row)
        np.testing.assert_array_equal(moment.y, core.y[row])
        assert moment.state == task.system_type.dynamics.State(*core.y[row])
        assert moment.input == task.system_type.dynamics.Input(*moment.u)
        assert moment.time == n_steps * task.dt and moment.success == core.flags[0, row]
        assert (moment.cost, moment.reward) == (core.results[0, row], core.results[-1, row])
        if not n_steps:
            assert moment.cost == moment.reward == 0.0 and not moment.success
            assert not moment.u.any() and not moment.action.any()
        act(core, n_steps)
    assert np.any(core.moment(row).action) and core.moment(row).reward
    core.reset(np.array([row]))
    moment = core.moment(row)
    assert moment.time == moment.cost == moment.reward == 0.0
    assert not moment.u.any() and not moment.action.any() and not moment.success
    assert core.moment(0).time == 3 * task.dt


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
    return workers.step(*outputs_of(len(workers._buffer)))


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
        assert (workers._buffer == k + 1).all()
    assert all(inbox.qsize() <= 1 for inbox in workers._inboxes)  # nobody is woken in advance


def test_every_step_is_published_to_the_arrays_that_it_is_given():
    workers, kept = team(n_blocks=64), []
    for _ in range(200):
        kept.append(outputs_of(64))
        workers.step(*kept[-1])
    for k, (results, observations, flags) in enumerate(kept):
        assert (results == k + 1).all() and (observations == k + 1).all() and flags.all()


def test_the_thread_that_is_woken_sleeps_no_more_and_all_others_do():
    for k in range(4):
        board = new_board(4)
        wake(board, k)
        assert [j for j in range(4) if not is_asleep(board, j)] == [k]


def test_threads_that_fall_asleep_wake_up():
    workers = team()
    for k in range(20):
        assert stepped(workers) == 6 and (workers._buffer == k + 1).all()
        assert waited_for(lambda: all_sleep(workers))


def test_shares_run_side_by_side():
    workers = team(n_blocks=2, n_threads=2, step=meet)  # two processors may not run three

    def all_met():
        workers._buffer[:] = 0.0
        return stepped(workers) == 2

    assert waited_for(all_met)  # threads that come late are not waited for


def test_a_refusal_of_one_share_is_that_of_all():
    workers = team(step=refuse)
    assert [stepped(workers) for _ in range(100)] == [-7] * 100


def test_threads_start_with_the_first_step_and_stay():
    before = threads_now()
    workers = team()
    act(begun(BallPark(), 2 * LANES))  # by none but the thread that asks
    assert threads_now() <= before  # those of environments that are gone may end meanwhile
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
