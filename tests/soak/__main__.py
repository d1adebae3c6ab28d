"""Make, use and drop environments for some time, and print what grows.

``python -m tests.soak [--minutes 60]``: threads, open files and resident memory of the process,
once in each sixtieth of the time. The exit status is 1 if threads or files grow after the first
quarter, or memory by more than 1 MiB an hour.
"""

import argparse
import sys
import time

import numpy as np

from tests.soak.cycle import Usage, cycle

LIMIT = 1.0  # [MiB/h]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    minutes = parser.parse_args().minutes
    begin, found, n_cycles = time.monotonic(), [], 0
    while (now := time.monotonic() - begin) < 60.0 * minutes:
        cycle(n_cycles)
        n_cycles += 1
        if now >= len(found) * minutes:  # sixty times
            found.append((now / 3600.0, Usage.of_this_process()))
            print(f"{now:7.0f} s {n_cycles:6d} cycles  {found[-1][1]}", flush=True)
    return verdict(found[len(found) // 4 :])


def verdict(found: list[tuple[float, Usage]]) -> int:
    """Print how much grew, and return the exit status."""
    hours, usages = zip(*found, strict=True)
    slope = np.polyfit(hours, [usage.memory for usage in usages], 1)[0]
    half = len(usages) // 2
    # the least of each half: a thread of an environment just dropped may still be ending
    threads, files = (
        [min(getattr(usage, name) for usage in part) for part in (usages[:half], usages[half:])]
        for name in ("threads", "files")
    )
    print(
        f"memory: {slope:+.2f} MiB an hour; threads: {threads[0]}, then {threads[1]}; "
        f"files: {files[0]}, then {files[1]}"
    )
    return int(slope > LIMIT or threads[1] > threads[0] or files[1] > files[0])


if __name__ == "__main__":
    sys.exit(main())
