"""The first signal asks a run to end, the second ends it at once, and none outlives the run."""

import os
import signal
import subprocess
import sys
import time

import pytest

from agents.training.trainer import StopSignals

BUSY = """
import sys, time
from agents.training.trainer import StopSignals
with StopSignals() as signals:
    print("ready", flush=True)
    time.sleep(60)
    time.sleep(60)
"""
STOPS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (signal.SIGINT, signal.SIGTERM),
        pytest.param(signal.SIGTERM, signal.SIGHUP, marks=pytest.mark.long),
        pytest.param(signal.SIGHUP, signal.SIGINT, marks=pytest.mark.long),
    ],
)
def test_a_second_signal_ends_at_once_with_its_number(
    first: signal.Signals, second: signal.Signals
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", BUSY], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(first)
        said = process.stderr.readline() + process.stderr.readline()
        assert (
            said == f"\n{first.name}: finishing this update, then saving; once more ends at once\n"
        )
        assert process.poll() is None
        begin = time.perf_counter()
        process.send_signal(second)
        assert process.wait(10) == 128 + second
        assert time.perf_counter() - begin < 5
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("number", STOPS)
def test_a_signal_is_noted_and_handlers_come_back(number: signal.Signals) -> None:
    before = [signal.getsignal(each) for each in STOPS]
    with StopSignals() as signals:
        assert not signals.stopping() and signals.received is None
        os.kill(os.getpid(), number)
        assert signals.stopping() and signals.received == number
    assert [signal.getsignal(each) for each in STOPS] == before
