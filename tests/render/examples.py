"""Views and moments for tests of what is seen."""

import math

import numpy as np

from rigid_envs.tasks.core import Moment
from rigid_envs.watch.views import view_of
from tests.from_pages.attitudes import matrix

Q = np.array([0.4, -0.2, 0.7, 0.5]) / math.sqrt(0.94)  # no symmetry


def placed(pose, point):
    """A point of a part in the world."""
    return np.asarray(pose.position) + matrix(pose.q) @ (np.array(pose.scale) * np.asarray(point))


def at(task, y, u=None, **aux):
    """The view of a task, and a moment in the state y."""
    system = task.system()
    parameters = {name: getattr(system, name) for name in system.parameter_names()}
    pushed = np.zeros(len(system.input_entries)) if u is None else u
    named = {name: 0.0 for name in task.aux_names} | aux
    return view_of(task, parameters), Moment(y, pushed, parameters, named, dynamics=system.dynamics)
