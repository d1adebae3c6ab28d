"""Coefficients that compose a symmetric second-order step into a fourth-order one.

Suzuki's fractal composition: five steps of length s h, s h, (1 - 4 s) h, s h, s h with s = 1 / (4 -
4^(1/3)). The result is symmetric and conserves every invariant of the single step (M. Suzuki 1990,
doi:10.1016/0375-9601(90)90962-N; Hairer, Lubich & Wanner, *Geometric Numerical Integration*,
section II.4). Its error constant is far below that of the three-step composition at the same cost
per unit of accuracy.
"""

__all__ = ["EXACT", "SUZUKI"]

_S = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))

SUZUKI = (_S, _S, 1.0 - 4.0 * _S, _S, _S)
EXACT = (1.0,)  # for steps that are the exact flow
