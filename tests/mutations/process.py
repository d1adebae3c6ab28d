"""Copies of the project: a Python process in one, and work that is shared among several."""

import subprocess
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

from tests.programs import python


def run_copy(folder, words, limit, **settings):
    """The finished process ``python WORDS`` in a copy of the project; None if time was up.

    Args:
        folder: The copy.
        words: Arguments of Python.
        limit: Time that it may take [s].
        **settings: Variables of its environment.
    """
    try:
        return python(
            *words,
            cwd=folder,
            limit=limit,
            PYTHONPATH=str(folder),
            PYTHONDONTWRITEBYTECODE="1",  # a change can have the size and the second of another
            **settings,
        )
    except subprocess.TimeoutExpired:
        return None


def shared_among(copies, items, work):
    """Results of work on items, in their order; each copy works on one item at a time."""
    free = SimpleQueue()
    for copy in copies:
        free.put(copy)

    def one(item):
        copy = free.get()
        try:
            return work(copy, item)
        finally:
            free.put(copy)

    with ThreadPoolExecutor(len(copies)) as pool:
        yield from pool.map(one, items)
