"""Proofs that no path of a rolling ball from a set of poses to a pose is shorter than a length.

The set is that of `least_path`, and so are the conditions that a shortest path meets. All paths
that meet them are in one of two families of elasticae, turning and swinging ones, with three
numbers (rho, sigma, eps) each (`nearby`). Their ranges are cut into parts by eps and rho. A part is
done with when its elasticae stay in strips that do not reach the pose (`strips`), or when boxes
that cover it do not meet the pose (`covering`).
"""

import itertools
import math

import numpy as np

from rigid_envs.base.checks import Array, Bools
from rigid_envs.systems.rolling_ball import covering, nearby, strips
from rigid_envs.systems.rolling_ball.covering import Poses, Room
from rigid_envs.systems.rolling_ball.meeting import N_PLACE

_EPS = (0.0, 0.001, 0.01, 0.03, 0.06, 0.1, 0.18, 0.3, 0.5, 1.0)
_RHO = (0.0, *(0.25 * k for k in range(6, 17)), *(0.5 * k for k in range(9, 21)), 12.0, 14.0)
_BENDS = (0.01, 0.02, 0.05, 0.1)
_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
_TOGETHER = 50  # poses of similar lengths
_MOST = 1_000_000  # boxes of a part that may meet a pose: a minute or so
_N_NODES, _N_CELLS = 3000, 4000  # more than any path has


def are_bounds(targets: Array, radii: Array, edge: float, lengths: Array) -> Bools:
    """Whether it is proven that no path from a set of poses to a pose is shorter than a length.

    Args:
        targets: Turn and displacement [radii] from the middle of each set to a pose, shape (n, 6).
        radii: Largest distance of each set [radii], shape (n,).
        edge: Largest angle of all sets [rad].
        lengths: To be proven [radii], shape (n,).

    Returns:
        Shape (n,).
    """
    proven = lengths <= 0.0
    order = np.argsort(lengths)[proven.sum() :]
    for begin in range(0, len(order), _TOGETHER):
        k = order[begin : begin + _TOGETHER]
        proven[k] = _are_bounds(targets[k], radii[k], edge, lengths[k])
    return proven


def _are_bounds(targets: Array, radii: Array, edge: float, lengths: Array) -> Bools:
    """The same of few poses."""
    bends = np.zeros(len(targets))
    found = np.zeros(len(targets), dtype=bool)
    for bend in _BENDS:
        strips.are_beside_straight_rolls(bend, targets, radii, edge, lengths, found)
        bends[found] = bend
    poses = Poses(numbers_of(targets), radii, lengths, bends, edge, 0.5 * float(lengths.mean()))
    unproven: Bools = bends == 0.0
    room = room_for()
    for swings, eps in itertools.product((False, True), itertools.pairwise(_EPS)):
        tall = np.full(len(targets), math.inf)
        for rho in _RHO[:0:-1]:
            strips.are_out_of_reach(swings, rho, eps, targets, radii, edge, lengths, found)
            tall[found] = rho
        unproven |= ~np.isfinite(tall)
        for low, high in itertools.pairwise(_RHO):
            alive = np.flatnonzero((tall >= high) & ~unproven)
            if alive.size:
                longest = float(lengths[alive].max())
                # beyond, paths are straight to within the least of the bends
                far = high * max(poses.middle, longest - poses.middle)
                far += math.log(4.0 * longest / _BENDS[0])
                least, largest = np.array([[low, -far, eps[0]], [high, far, eps[1]]])
                covering.leftover(swings, least, largest, poses, alive, _MOST, room, unproven)
    return ~unproven


def room_for() -> Room:
    """Arrays that boxes are worked out in."""
    return Room(
        table=np.zeros((2, nearby.N_LANDEN)),
        nodes=np.zeros((_N_NODES, 7)),
        cells=np.zeros((_N_CELLS, 3)),
        path=np.zeros((_N_NODES + 1, nearby.N_PATH)),
        at=np.zeros(N_PLACE),
        beside=np.zeros(N_PLACE),
        m=np.zeros((5, 6)),
    )


def numbers_of(targets: Array) -> Array:
    """What turns of the plane leave of poses and of their mirror images, shape (2n, 5)."""
    w, x, y, z = targets[:, :4].T
    b, p = 2.0 * (x + 1j * y), targets[:, 4] + 1j * targets[:, 5]
    product = np.conj(p) * b
    numbers = np.stack([2.0 * w, 2.0 * z, np.abs(p) ** 2, product.real, product.imag], axis=-1)
    return np.stack([numbers, numbers * _MIRROR], axis=1).reshape(-1, 5)
