"""Counter-based random numbers: a value is a pure function of (key, episode, index).

Philox4x64-10 (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11,
doi:10.1145/2063384.2063405), the generator behind `numpy.random.Philox`, against which it is
tested. Each row has its own key, so it draws the same numbers for any number of rows and threads.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import Signature

from rigid_envs.engine.algebra import Quaternion, Vector
from rigid_envs.engine.compiler import instruction, routine, scalar
from rigid_envs.engine.elementary import log, sincos

Word = np.uint64
Stream = tuple[Word, Word, Word]  # key of the row, episode, use

_M0 = np.uint64(0xD2E7470EE14C6C93)
_M1 = np.uint64(0xCA5A826395121157)
_W0 = np.uint64(0x9E3779B97F4A7C15)
_W1 = np.uint64(0xBB67AE8584CAA73B)
_ZERO = np.uint64(0)


@instruction
def _high_product(_context: Any, a: Any, b: Any) -> tuple[Signature, Callable[..., Any]]:
    """Upper 64 bits of the 128-bit product."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(*(builder.zext(x, wide) for x in arguments))
        return builder.trunc(builder.lshr(product, ir.Constant(wide, 64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), generate


@scalar
def philox(
    c0: Word, c1: Word, c2: Word, c3: Word, k0: Word, k1: Word
) -> tuple[Word, Word, Word, Word]:
    """Ten rounds of Philox on a 256-bit counter and a 128-bit key (all uint64)."""
    for _ in range(10):
        h0, l0 = _high_product(_M0, c0), _M0 * c0
        h1, l1 = _high_product(_M1, c2), _M1 * c2
        c0, c1, c2, c3 = h1 ^ c1 ^ k0, l1, h0 ^ c3 ^ k1, l0
        k0, k1 = k0 + _W0, k1 + _W1
    return c0, c1, c2, c3


@routine
def _four(stream: Stream, index: int) -> tuple[float, float, float, float]:
    """Four independent uniforms in [0, 1), 53 bits each."""
    key, episode, use = stream
    words = philox(
        np.uint64(index), np.uint64(use), np.uint64(episode), _ZERO, np.uint64(key), _ZERO
    )
    shift = np.uint64(11)
    unit = 1.0 / 9007199254740992.0
    return (
        float(words[0] >> shift) * unit,
        float(words[1] >> shift) * unit,
        float(words[2] >> shift) * unit,
        float(words[3] >> shift) * unit,
    )


@scalar
def uniform(stream: Stream, index: int) -> float:
    """Uniform in [0, 1)."""
    return _four(stream, index)[0]


@routine
def normal_pair(stream: Stream, index: int) -> tuple[float, float]:
    """Two independent standard normals (Box & Muller)."""
    a, b, _, _ = _four(stream, index)
    radius = math.sqrt(-2.0 * log(1.0 - a))
    s, c = sincos(2.0 * math.pi * b)
    return radius * c, radius * s


@scalar
def in_disk(stream: Stream, index: int) -> tuple[float, float]:
    """Uniform in the unit disk, by rejection (indices from `index` on)."""
    while True:
        a, b, _, _ = _four(stream, index)
        x, y = 2.0 * a - 1.0, 2.0 * b - 1.0
        if x * x + y * y <= 1.0:
            return x, y
        index += 1


@scalar
def in_ball(stream: Stream, index: int) -> Vector:
    """Uniform in the unit ball, by rejection (indices from `index` on)."""
    while True:
        a, b, c, _ = _four(stream, index)
        x, y, z = 2.0 * a - 1.0, 2.0 * b - 1.0, 2.0 * c - 1.0
        if x * x + y * y + z * z <= 1.0:
            return x, y, z
        index += 1


@scalar
def direction(stream: Stream, index: int) -> tuple[float, float]:
    """Uniform on the unit circle, by rejection (indices from `index` on)."""
    while True:
        x, y = in_disk(stream, index)
        n = math.sqrt(x * x + y * y)
        if n > 1e-3:
            return x / n, y / n
        index += 1000


@scalar
def quaternion(stream: Stream, index: int) -> Quaternion:
    """Uniform attitude: a point of the unit 3-sphere (Marsaglia 1972, doi:10.1214/aoms/1177692644).

    Two points of the unit disk, the second scaled onto the sphere.
    """
    while True:
        a, b, c, d = _four(stream, index)
        w, x, y, z = 2.0 * a - 1.0, 2.0 * b - 1.0, 2.0 * c - 1.0, 2.0 * d - 1.0
        s, t = w * w + x * x, y * y + z * z
        if s <= 1.0 and 0.0 < t <= 1.0:
            f = math.sqrt((1.0 - s) / t)
            return w, x, f * y, f * z
        index += 1
