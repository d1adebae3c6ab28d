"""Bodies of revolution that roll, or slide until they roll, in closed form.

All that a rolling body needs to know of itself is its inertia ratio beta = I / (m r^2): 0 for a
block that slides without friction, 2/5 for a solid sphere, 1/2 for a cylinder, 2/3 for a hollow
sphere, 1 for a hoop. Rolling turns the body, too, as if its mass were (1 + beta) m.
"""

from rigid_envs.analytic.roller._incline import Descent, descend
from rigid_envs.analytic.roller._sliding import SlipToRoll, slide, slip_to_roll
from rigid_envs.analytic.roller._valley import Swing, swing, valley
from rigid_envs.analytic.roller._wheel import cycloid_arch_length, roll_wheel

__all__ = [
    "Descent",
    "SlipToRoll",
    "Swing",
    "cycloid_arch_length",
    "descend",
    "roll_wheel",
    "slide",
    "slip_to_roll",
    "swing",
    "valley",
]
