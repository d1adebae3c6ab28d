"""What a package of its own needs to define a system and a task: see ``docs/extending.md``.

The names are collected here from their modules, in which they are documented.
"""

from rigid_envs.checks import non_negative, number, positive
from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import (
    clip_to_ball,
    clip_to_box,
    clip_to_disk,
    clip_to_interval,
    clip_to_square,
    keep,
)
from rigid_envs.kernels.algebra import (
    attitude,
    compose,
    cross,
    dot,
    log_rotation,
    normalize,
    normalize_near_unit,
    rotate,
    rotate_inverse,
)
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.composition import EXACT, SUZUKI
from rigid_envs.kernels.contact import on_ground
from rigid_envs.kernels.dynamics import Dynamics
from rigid_envs.kernels.elementary import atan2, cbrt, fma, log, select, sincos, sqrt
from rigid_envs.kernels.episode import Episode, NoAuxiliary, NoConstants
from rigid_envs.kernels.turns import cayley, half_turn, tangent
from rigid_envs.systems import RollingContact, System
from rigid_envs.systems.accessors import ATTITUDE
from rigid_envs.tasks.base import ROTATION, Entry, Task
from rigid_envs.tasks.fields import Choice, Flag, Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.ground import Rolling

__all__ = [
    "ATTITUDE",
    "EXACT",
    "ROTATION",
    "SUZUKI",
    "Choice",
    "Dynamics",
    "Entry",
    "Episode",
    "Flag",
    "Integer",
    "NoAuxiliary",
    "NoConstants",
    "Number",
    "Range",
    "Rolling",
    "RollingContact",
    "System",
    "Task",
    "atan2",
    "attitude",
    "cayley",
    "cbrt",
    "clip_to_ball",
    "clip_to_box",
    "clip_to_disk",
    "clip_to_interval",
    "clip_to_square",
    "compose",
    "cross",
    "dot",
    "fma",
    "half_turn",
    "keep",
    "log",
    "log_rotation",
    "non_negative",
    "normalize",
    "normalize_near_unit",
    "number",
    "on_ground",
    "physical",
    "positive",
    "randoms",
    "rotate",
    "rotate_inverse",
    "scalar",
    "select",
    "setting",
    "sincos",
    "span",
    "sqrt",
    "tangent",
]
