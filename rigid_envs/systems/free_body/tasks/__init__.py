"""Tasks of the free body."""

from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.free_body.tasks.detumble import Detumble
from rigid_envs.systems.free_body.tasks.intermediate_axis import (
    IntermediateAxis,
    IntermediateAxisRandom,
)
from rigid_envs.systems.free_body.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.systems.free_body.tasks.reorient import Reorient
from rigid_envs.systems.free_body.tasks.spin_capture import SpinCapture

__all__ = [
    "AxisFlip",
    "Detumble",
    "IntermediateAxis",
    "IntermediateAxisRandom",
    "IntermediateAxisSingle",
    "Reorient",
    "SpinCapture",
]
