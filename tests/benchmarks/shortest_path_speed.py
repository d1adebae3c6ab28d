"""Time of a shortest path home, beside SciPy's SLSQP on a polygon of 24 sides from one guess.

Run as a program: ``python -m tests.benchmarks.shortest_path_speed``. Both are asked in turns, for
the poses of test_shortest_path.py. SLSQP finds a local minimum: one guess is rarely
enough for the shortest.
"""

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.systems.rolling_ball.shortest_path import shortest_path
from tests.systems.rolling_ball.test_shortest_path import FEW, HOME, best_polygon, poses


def seconds(
    call: Callable[[npt.NDArray[np.float64]], object], pose: npt.NDArray[np.float64]
) -> float:
    """Processor time of a call."""
    begin = time.process_time()
    call(pose)
    return time.process_time() - begin


def ours(pose: npt.NDArray[np.float64]) -> object:
    """The shortest path."""
    return shortest_path(pose, HOME)


def peer(pose: npt.NDArray[np.float64]) -> object:
    """A polygon, from a guess of the mean length."""
    return best_polygon(pose, 6.0, n_guesses=1)


def main() -> None:
    """Print medians and their ratio."""
    ours(poses()[0])  # compiles
    took = np.array([[seconds(call, pose) for call in (ours, peer)] for pose in poses()[:FEW]])
    path, guess = np.median(took, axis=0)
    print(f"shortest_path {path:.3f} s, SLSQP {guess:.3f} s, ratio {path / guess:.2f}")


if __name__ == "__main__":
    main()
