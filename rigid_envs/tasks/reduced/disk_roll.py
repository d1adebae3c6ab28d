"""Reduced coordinates of a rolling disk and the circle that it is to roll on."""

from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, fma, log, select
from rigid_envs.symmetries.disks import EXCHANGE, PHASE, REFLECTION, TRANSLATION, TURN
from rigid_envs.tasks.disks import TIGHT, rolling
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction, Side

__all__ = ["CIRCLE"]

_FAST = 50.0  # rad/s; bound of the observed rates
_LEAN = 1.6  # rad
_WRONG = 20.0  # bound of the relative error
_LOG = 17.0  # bound of its logarithm
_GYRO = 20.0  # rad^2/s^2; bound of the gyroscopic moment
# I3 / I1 and m r^2 / (I3 + m r^2) of a uniform disk: those of the wheel may be drawn and hidden
_RATIO, _RIM_RATIO = 2.0, 2.0 / 3.0
_NEAR = 0.03  # rad; limit of the lean that is missing, on its finer scale


@scalar
def side(aux: Any) -> float:
    """-1 where the commanded circle is on the right, else 1."""
    return select(aux.goal_curvature < 0.0, -1.0, 1.0)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, rates and errors from steady rolling, on a circle to the left and forwards.

    Without steering torque wn and w3 follow the lean; see `DiskRoll`. One step of Newton's method
    leads to the lean at which the curvature is the commanded one, and to wn and w3 there.
    """
    motion = rolling(y)
    mirrored = side(aux)
    turned = mirrored * select(motion.roll_rate < 0.0, -1.0, 1.0)
    lean = mirrored * atan2(motion.sin_lean, motion.cos_lean)
    wn, w3 = turned * motion.turn_rate, abs(motion.roll_rate)
    k, goal = mirrored * motion.curvature, mirrored * aux.goal_curvature
    inverse = 1.0 / motion.cos_lean
    tan = mirrored * motion.sin_lean * inverse
    spin = fma(wn, tan, w3)  # psi'
    wn_slope, w3_slope = fma(_RATIO, w3, wn * tan), _RIM_RATIO * wn
    spin_slope = w3_slope + wn_slope * tan + wn * inverse * inverse
    k_slope = (wn_slope * inverse - k * spin_slope) / max(spin, 0.1) + k * tan
    missing = min(max((goal - k) / max(k_slope, 0.5), -0.5), 0.5)
    wrong = (k - goal) / goal
    size = log(1.0 + min(abs(wrong), _WRONG) / c.tolerance)
    steady = (wn + wn_slope * missing) * (w3 + w3_slope * missing)
    return (
        lean,
        min(max(mirrored * motion.lean_rate, -_FAST), _FAST),
        min(max(wn, -_FAST), _FAST),
        min(w3, _FAST),
        k,
        goal,
        min(max(wrong, -_WRONG), _WRONG),
        select(wrong < 0.0, -size, size),
        missing,
        min(max(missing * (1.0 / _NEAR), -1.0), 1.0),
        lean + missing,
        min(max(steady, -_GYRO), _GYRO),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """The side on which the commanded circle is."""
    return Side(side(aux))


@scalar
def turn(a: Any, frame: Any) -> tuple[float]:
    """The torque about the direction of travel as `DiskRoll` defines it."""
    return (frame.sign * a[0],)


CIRCLE = Reduction(
    group="E(2) x O(2) x Z2",
    frame=(
        "mirrored so that the commanded circle is on the left, and seen so that the disk rolls "
        "forwards."
    ),
    symmetries=(TRANSLATION, TURN, PHASE, REFLECTION, EXCHANGE),
    features=(
        Entry("lean", "rad", "goal on the left", -_LEAN, _LEAN),
        Entry("theta'", "rad/s", "goal on the left", -_FAST, _FAST),
        Entry("wn", "rad/s", "goal on the left, forwards", -_FAST, _FAST),
        Entry("w3", "rad/s", "forwards", 0.0, _FAST),
        Entry("curvature * radius", "1", "goal on the left", -TIGHT, TIGHT),
        Entry("goal curvature * radius", "1", "goal on the left", 0.0, 2.0),
        Entry("relative error e", "1", "of the curvature", -_WRONG, _WRONG),
        Entry("log(1 + e / tolerance)", "1", "with the sign of e", -_LOG, _LOG),
        Entry("missing lean", "rad", "uniform disk", -0.5, 0.5),
        Entry("missing lean", "1", f"uniform disk, in {_NEAR:g} rad, limited", -1.0, 1.0),
        Entry("steady lean", "rad", "uniform disk", -_LEAN - 0.5, _LEAN + 0.5),
        Entry("steady wn w3", "rad^2/s^2", "uniform disk", -_GYRO, _GYRO),
    ),
    observe=observe,
    Frame=Side,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        With s = -1 where the commanded curvature is negative, else 1, and t = -s where w3 is
        negative, else s: lean, theta', both curvatures and the action are multiplied by s, wn and
        w3 by t. Of what is multiplied, with lean x, curvature k and its goal k*: ``e = (k - k*) /
        k*``, and the logarithm is that of |e| <= 20.

        With ``a = 2 w3 + wn tan x`` and ``b = 2 wn / 3``, the changes of wn and w3 with the lean of
        a uniform disk, ``psi' = w3 + wn tan x``, and ``c = (a / cos x - k (b + a tan x + wn /
        cos^2 x)) / max(psi', 0.1) + k tan x``: the missing lean is ``d = (k* - k) / max(c, 0.5)``
        within +-0.5, the steady lean ``x + d``, and the steady wn w3 ``(wn + a d) (w3 + b d)``.
    """,
)
"""Reduction of `DiskRoll`: motions of the plane, turns of the disk, two reflections."""
