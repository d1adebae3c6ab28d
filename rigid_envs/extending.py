"""What a package of its own needs to define a system and a task: see ``docs/extending.md``.

The names are collected here from their modules, in which they are documented.
"""

from rigid_envs.base.checks import non_negative, number, positive
from rigid_envs.base.settings import Choice, Flag, Integer, Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import (
    EXACT,
    SUZUKI,
    attitude,
    cayley,
    compose,
    cross,
    dot,
    half_turn,
    log_rotation,
    normalize,
    normalize_near_unit,
    on_ground,
    rotate,
    rotate_inverse,
    tangent,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import atan2, cbrt, fma, log, select, sincos, sqrt
from rigid_envs.engine.episode import (
    Episode,
    NoAuxiliary,
    NoConstants,
    clip_to_ball,
    clip_to_box,
    clip_to_disk,
    clip_to_interval,
    clip_to_square,
    keep,
)
from rigid_envs.mechanics.equations import ATTITUDE, RollingContact
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.fields import ROTATION, Entry, Range, physical, span
from rigid_envs.tasks.task import Rolling, Task

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
    "refusal",
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
