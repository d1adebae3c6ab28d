"""The same free body in MuJoCo: a ball joint, no gravity, three motors.

MuJoCo's `rollout` steps all rows from a start of their own in compiled code, in one thread; it
does the physics only, without observation, reward or reset.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigid_envs.cli.bench.accuracy import OMEGA0, FreeRun, errors, free_run
from rigid_envs.cli.bench.race import Contestant
from rigid_envs.systems import FreeBody
from rigid_envs.tasks import IntermediateAxis

__all__ = ["Opponent", "is_installed", "mujoco_contestants", "opponents"]

_ROWS = 4096
_MOST_SUBSTEPS = 16
# everything that a free body does not need is off: the fastest that MuJoCo can be
_MODEL = """
<mujoco>
  <option integrator="{integrator}" timestep="{timestep!r}">
    <flag contact="disable" constraint="disable" gravity="disable" frictionloss="disable"
          limit="disable" equality="disable" spring="disable" damper="disable" warmstart="disable"/>
  </option>
  <worldbody><body>
    <joint name="free" type="ball"/>
    <inertial pos="0 0 0" mass="1" diaginertia="{moments}"/>
  </body></worldbody>
  <actuator>
    <motor joint="free" gear="1 0 0" ctrllimited="true" ctrlrange="-{torque} {torque}"/>
    <motor joint="free" gear="0 1 0" ctrllimited="true" ctrlrange="-{torque} {torque}"/>
    <motor joint="free" gear="0 0 1" ctrllimited="true" ctrlrange="-{torque} {torque}"/>
  </actuator>
</mujoco>
"""


@dataclass(frozen=True)
class Opponent:
    """A way to integrate the body in MuJoCo, with what it costs in accuracy.

    Attributes:
        integrator: MuJoCo's name of it.
        n_substeps: its steps in one control period.
        why: why so many.
        errors: of the torque-free run that decided it.
    """

    integrator: str
    n_substeps: int
    why: str
    errors: FreeRun

    @property
    def name(self) -> str:
        """Its name in the report."""
        return f"MuJoCo {self.integrator} x {self.n_substeps}"


def is_installed() -> bool:
    """Whether MuJoCo can be imported."""
    return importlib.util.find_spec("mujoco") is not None


def opponents() -> list[Opponent]:
    """RK4 in as few substeps as give our energy error or less, and Euler, the default, in as many.

    Over an hour and a half (6000 s), our error is bounded and that of RK4 grows; so it is counted
    once for that time and once for a minute.
    """
    found = [_equal_in_energy(duration) for duration in (60.0, 6000.0)]
    euler = Opponent("Euler", found[-1].n_substeps, "MuJoCo's default integrator", found[-1].errors)
    return [*found, replace(euler, errors=_free_run("Euler", euler.n_substeps, 60.0))]


def mujoco_contestants(opponents: list[Opponent]) -> list[Contestant]:
    """One for each way, 4096 rows, one control period at a time."""
    return [Contestant(opponent.name, "4096", _rollout(opponent)) for opponent in opponents]


def _equal_in_energy(duration: float) -> Opponent:
    task = IntermediateAxis()
    ours = free_run(task.dt / task.n_substeps, duration)
    for n_substeps in range(1, _MOST_SUBSTEPS + 1):
        theirs = _free_run("RK4", n_substeps, duration)
        if theirs.energy <= ours.energy or n_substeps == _MOST_SUBSTEPS:
            break
    return Opponent("RK4", n_substeps, f"our energy error over {duration:g} s", theirs)


def _rollout(opponent: Opponent) -> Callable[[int], int]:
    rollout, model, data, start = _set_up(opponent.integrator, opponent.n_substeps)
    random = np.random.default_rng(0)
    starts = np.tile(start, (_ROWS, 1))
    limit = IntermediateAxis().torque
    torque = random.uniform(-limit, limit, (_ROWS, 1, model.nu)).repeat(opponent.n_substeps, axis=1)
    state = np.empty((_ROWS, opponent.n_substeps, len(start)))

    def burst(steps: int) -> int:
        for _ in range(steps):
            rollout.rollout(model, data, starts, torque, state=state)
        return steps * _ROWS

    return burst


def _free_run(integrator: str, n_substeps: int, duration: float) -> FreeRun:
    """Errors of a torque-free run, looked at once in every control period."""
    rollout, model, data, start = _set_up(integrator, n_substeps)
    n = round(duration / IntermediateAxis().dt)
    states, _ = rollout.rollout(model, data, start[None], nstep=n * n_substeps)
    velocity = slice(1 + model.nq, 1 + model.nq + model.nv)
    omega = np.vstack([start[None, velocity], states[0, n_substeps - 1 :: n_substeps, velocity]])
    return errors(IntermediateAxis().dt * np.arange(n + 1), omega)


def _set_up(integrator: str, n_substeps: int) -> tuple[Any, Any, Any, Any]:
    """A single-threaded rollout, model, data and the state near the unstable axis."""
    import mujoco
    from mujoco.rollout import Rollout

    body, task = FreeBody(), IntermediateAxis()
    text = _MODEL.format(
        integrator=integrator,
        timestep=task.dt / n_substeps,
        moments=" ".join(map(str, body.moments)),
        torque=task.torque,
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[:] = OMEGA0
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS  # time, positions, velocities
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return Rollout(nthread=0), model, data, state
