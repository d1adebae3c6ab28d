"""Chooses the starts of the evaluation set, so that their mean is that of all starts.

    python -m rigid_envs.tools.fair_starts        # a minute; writes rigid_envs/scores/starts.json

The mean of a smooth quantity over n random starts is off by its standard deviation / sqrt(n). Over
starts that are spread evenly it is nearer. How evenly starts are spread is measured by the maximum
mean discrepancy of a Gaussian kernel, here by its random features (Gretton et al. 2012, *A kernel
two-sample test*, JMLR 13; Rahimi & Recht 2007, *Random features for large-scale kernel machines*):

    sum over ids of |mean over the set of phi(x) - mean over all of phi(x)|^2,

where x is what the reduced frame shows of a start, with the drawn parameters, whitened. One set
serves all ids. It keeps most of the set before, whose best known costs and records so stay of use:
starts are dropped one after the other, and then others of the same sequence added, each the one
after which the discrepancy is least (kernel herding: Chen, Welling & Smola 2010).
"""

import sys
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array, Integers
from rigid_envs.base.files import write_document
from rigid_envs.scores import starts
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.tasks.registry import ENVIRONMENTS

_N_FEATURES = 256  # frequencies of each id
_WIDTH = 1.25  # of the kernel, in standard deviations per square root of the dimension
_N_NEW = 50  # starts that were not in the set before
_LEAST = 1e-3  # spread of a coordinate that counts, of the largest one


def coordinates(env_id: str, seeds: list[int]) -> Array:
    """What tells starts of an id apart: uncorrelated, mean 0 and variance 1, shape (n, k).

    Args:
        env_id: Gymnasium's id.
        seeds: Seed of each start.
    """
    rows = make_rows(env_id, len(seeds), {"frame": "reduced"})
    seen: Any = rows.reset(seed=seeds)[0]
    shown = seen["observation"] if isinstance(seen, dict) else seen
    x = np.concatenate([shown, rows.get_state()["parameters"]], axis=1).astype(np.float64)
    x -= x.mean(axis=0)
    spread, axes = np.linalg.svd(x, full_matrices=False)[1:]
    z = x @ axes[spread > _LEAST * spread[0]].T
    return np.asarray(z / z.std(axis=0))


def features(z: Array, rng: np.random.Generator) -> Array:
    """Random features of a Gaussian kernel, less their mean over all starts, shape (n, 2 K).

    Their mean square is 1, so that all ids weigh the same.

    Args:
        z: Coordinates of all starts, shape (n, k).
        rng: Draws the frequencies.
    """
    k = z.shape[1]
    phase = z @ rng.normal(size=(k, _N_FEATURES)) / (_WIDTH * np.sqrt(k))
    phi = np.concatenate([np.cos(phase), np.sin(phase)], axis=1)
    phi -= phi.mean(axis=0)
    return np.asarray(phi / np.sqrt(np.sum(phi * phi, axis=1).mean()))


def chosen(phi: Array, n: int, n_new: int) -> Integers:
    """Places of the starts: those kept of the first n in their order, then the new ones.

    Args:
        phi: Features of all starts, shape (N, K), of mean 0.
        n: Number of starts.
        n_new: How many of them are new.
    """
    kept, new = list(range(n)), []
    total, square = phi[:n].sum(axis=0), np.sum(phi * phi, axis=1)
    for _ in range(n_new):
        worst = kept.pop(int(np.argmin(square[kept] - 2.0 * phi[kept] @ total)))
        total = total - phi[worst]
    free = np.arange(len(phi)) >= n
    for _ in range(n_new):
        best = int(np.argmin(np.where(free, square + 2.0 * phi @ total, np.inf)))
        total, free[best] = total + phi[best], False
        new.append(best)
    return np.array([*kept, *new])


def main() -> int:
    """Choose, write, and say how even the starts are."""
    n, rng = starts.N_STARTS, np.random.default_rng(starts.TEST_SEED)
    seeds = starts.drawn_seeds(starts.TEST_SEED, range(starts.N_DRAWN), "test")
    phi = np.concatenate([features(coordinates(e, seeds), rng) for e in ENVIRONMENTS], axis=1)
    places = chosen(phi, n, _N_NEW)
    data = {"format": starts.PLACES_FORMAT, "places": places.tolist()}
    write_document(starts.PLACES_FILE, data)
    for name, part in (("first", np.arange(n)), ("chosen", places)):
        print(f"{name:8}{n * np.sum(phi[part].mean(axis=0) ** 2) / len(ENVIRONMENTS):.3f}")
    print("1 is what starts drawn at random have in the mean")
    return 0


if __name__ == "__main__":
    sys.exit(main())
