"""Accuracy and cost of a free body, beside MuJoCo."""

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxis
from rigid_envs.tools.bench.measuring import Workload

# Accuracy of the free body: energy, |L|^2 and angular velocity against the closed form.

OMEGA0 = (0.01, 1.0, 0.01)
"""Initial angular velocity [rad/s], body axes: beside the unstable axis, so that it flips."""


class FreeRun(NamedTuple):
    """Errors of a torque-free run.

    Attributes:
        dt: step [s].
        duration: simulated time [s].
        energy: largest relative error of the energy.
        L_squared: largest relative error of |L|^2.
        omega_end: error of omega at the end [rad/s].
        omega_largest: largest error of omega [rad/s]; most of it is a shift in time of a flip.
    """

    dt: float
    duration: float
    energy: float
    L_squared: float
    omega_end: float
    omega_largest: float


def free_run(dt: float, duration: float) -> FreeRun:
    """Simulate the default body without torque.

    Args:
        dt: step [s].
        duration: simulated time [s].
    """
    body = FreeBody()
    t = dt * np.arange(round(duration / dt) + 1)
    start = body.state(omega_body=OMEGA0)
    path = body.simulate(start, t, max_step=1.001 * dt)  # one step per interval: times are rounded
    return errors(t, path["omega_body"])


def errors(t: npt.NDArray[Any], omega: npt.NDArray[Any]) -> FreeRun:
    """Errors of a torque-free run of the default body that starts at `OMEGA0`.

    Args:
        t: times [s], shape (M,).
        omega: angular velocity at these times, body axes [rad/s], shape (M, 3).
    """
    body = FreeBody()
    L = body.moments * omega
    energy = 0.5 * np.sum(L * omega, axis=-1)
    square = np.sum(L * L, axis=-1)
    exact = free_body.omega(t, body.moments, OMEGA0)
    error = np.max(np.abs(omega - exact), axis=-1)
    return FreeRun(
        dt=float(t[1] - t[0]),
        duration=float(t[-1]),
        energy=float(np.max(np.abs(energy / energy[0] - 1.0))),
        L_squared=float(np.max(np.abs(square / square[0] - 1.0))),
        omega_end=float(error[-1]),
        omega_largest=float(error.max()),
    )


# The same free body in MuJoCo: a ball joint, no gravity, three motors.
#
# MuJoCo's `rollout` steps all rows in compiled code, in one thread: physics only, without
# observation, reward or reset.

_ROWS = 4096
_MOST_SUBSTEPS = 16
# All that a free body does not need is disabled: MuJoCo at its fastest.
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


class MujocoSetting(NamedTuple):
    """Integrator and substeps of the body in MuJoCo, and the accuracy they give.

    Attributes:
        integrator: "RK4" or "Euler", as MuJoCo names it.
        n_substeps: integrator steps per control period.
        why: reason for that number.
        errors: errors of a torque-free run.
    """

    integrator: str
    n_substeps: int
    why: str
    errors: FreeRun

    @property
    def name(self) -> str:
        """Name in the report."""
        return f"MuJoCo {self.integrator} x {self.n_substeps}"


def is_installed() -> bool:
    """Whether MuJoCo can be imported."""
    return importlib.util.find_spec("mujoco") is not None


def mujoco_settings() -> list[MujocoSetting]:
    """RK4 with the fewest substeps that reach our energy error, and Euler with as many.

    Our energy error is bounded, that of RK4 grows with time: the substeps are found for 60 s and
    for 6000 s. Euler is MuJoCo's default.
    """
    found = [_equal_in_energy(duration) for duration in (60.0, 6000.0)]
    n_substeps = found[-1].n_substeps
    euler = _free_run("Euler", n_substeps, 60.0)
    return [*found, MujocoSetting("Euler", n_substeps, "MuJoCo's default integrator", euler)]


def mujoco_workloads(settings: list[MujocoSetting]) -> list[Workload]:
    """One for each setting: 4096 rows, one control period at a time."""
    return [Workload(setting.name, "4096", _rollout(setting)) for setting in settings]


def _equal_in_energy(duration: float) -> MujocoSetting:
    task = IntermediateAxis()
    ours = free_run(task.dt / task.n_substeps, duration)
    for n_substeps in range(1, _MOST_SUBSTEPS + 1):
        theirs = _free_run("RK4", n_substeps, duration)
        if theirs.energy <= ours.energy or n_substeps == _MOST_SUBSTEPS:
            break
    return MujocoSetting("RK4", n_substeps, f"our energy error over {duration:g} s", theirs)


def _rollout(setting: MujocoSetting) -> Callable[[int], int]:
    rollout, model, data, start = _set_up(setting.integrator, setting.n_substeps)
    random = np.random.default_rng(0)
    starts = np.tile(start, (_ROWS, 1))
    limit = IntermediateAxis().torque
    torque = random.uniform(-limit, limit, (_ROWS, 1, model.nu)).repeat(setting.n_substeps, axis=1)
    state = np.empty((_ROWS, setting.n_substeps, len(start)))

    def run(steps: int) -> int:
        for _ in range(steps):
            rollout.rollout(model, data, starts, torque, state=state)
        return steps * _ROWS

    return run


def _free_run(integrator: str, n_substeps: int, duration: float) -> FreeRun:
    """Errors of a torque-free run, sampled once per control period."""
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
