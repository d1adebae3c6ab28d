"""Nothing grows while environments are made, used and dropped."""

import gc
import time

from tests.soak.__main__ import LIMIT, verdict
from tests.soak.cycle import IDS, Usage, cycle


def after(n_rounds: int) -> Usage:
    """What is used after some rounds through a few ids."""
    for _ in range(n_rounds):
        for k in range(0, len(IDS), 5):
            cycle(k)
    gc.collect()
    return Usage.of_this_process()


def no_more_threads_than(most: int) -> bool:
    """Whether no more are left soon: those of a dropped environment end by themselves."""
    end = time.monotonic() + 30.0
    while (found := Usage.of_this_process().threads) > most and time.monotonic() < end:
        time.sleep(0.01)
    return found <= most


def test_threads_and_files_do_not_grow_and_memory_hardly_does():
    first = after(10)  # compiles, and fills caches
    last = after(60)
    assert no_more_threads_than(first.threads)
    assert last.files <= first.files
    assert last.memory - first.memory < 3.0  # [MiB]; 600 environments dropped, of 0.2 MiB each


def test_growth_is_noticed():
    steady, hours = Usage(2, 6, 250.0), [0.25 * k for k in range(5)]
    assert verdict([(hour, steady) for hour in hours]) == 0
    leaks = [Usage(2, 6, 250.0 + 2.0 * LIMIT * hour) for hour in hours]
    assert verdict(list(zip(hours, leaks, strict=True))) == 1
    for worse in (steady._replace(threads=3), steady._replace(files=7)):
        assert verdict([(0.0, steady), (1.0, worse)]) == 1
