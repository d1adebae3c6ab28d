# %% [markdown]
# # From LQR to NMPC
#
# Every environment knows its equations: `env.unwrapped.system`. So control by a model needs no second model. Here a
# body is held in spin about its intermediate axis, which is unstable (see [the lecture](06_dzhanibekov.py)): first by
# linear feedback, which is proven near the spin and fails far from it, then by optimising over the nonlinear motion.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import rigid_envs
from rigid_envs.control import lqr, region_of_attraction, simulate_closed_loop, zero_order_hold

env_id = "RigidEnvs/IntermediateAxis-v0"
env = gym.make(env_id)
env.reset(seed=0)
task, system = env.unwrapped.task, env.unwrapped.system
print(system)
print(
    f"Omega = {task.spin_rate} rad/s, largest torque {task.torque} N m, a new one every {task.dt} s"
)

# %% [markdown]
# ## Linearisation
#
# `linearize(y, u)` gives the Jacobians $A$ and $B$ of $\dot y = f(y, u)$, exact to rounding, from the very equations
# that are simulated. The attitude does not matter here; the part that does is the angular velocity,
#
# $$
# \dot x = A x + B \tau, \qquad x = \omega - \Omega e_2 .
# $$

# %%
rates = system.components["omega_body"]
spin = system.state(omega_body=[0.0, task.spin_rate, 0.0])
A, B = system.linearize(spin)
A, B = A[rates, rates], B[rates, :3]
print("A =\n", A)
print("eigenvalues", np.linalg.eigvals(A))

# %% [markdown]
# One eigenvalue is positive. A torque is held over a control period, so the regulator is designed for the sampled
# model $x_{k+1} = F x_k + G \tau_k$. It minimises $\sum_k x_k^T Q x_k + \tau_k^T R \tau_k$:
#
# $$
# \tau = -K x, \qquad K = (R + G^T P G)^{-1} G^T P F, \qquad P = Q + F^T P (F - G K),
# $$
#
# and $V(x) = x^T P x$ is the cost to go, and a Lyapunov function.

# %%
F, G = zero_order_hold(A, B, task.dt)
regulator = lqr(F, G, np.ones(3), np.full(3, 0.03))
closed = np.abs(np.linalg.eigvals(F - G @ regulator.gain))
print("without feedback, |eigenvalues| up to", np.abs(np.linalg.eigvals(F)).max().round(4))
print("with feedback,    |eigenvalues| up to", closed.max().round(4))

# %% [markdown]
# ## In the environment
#
# An observation is $\omega / \Omega$, an action is the torque over the largest. Both are known by name to the task; we
# write the regulator as a function of the observations of all rows, and score it from the 500 starts.


# %%
def linear(observations: np.ndarray) -> np.ndarray:
    """Action of the regulator, in the box."""
    x = task.spin_rate * (observations - [0.0, 1.0, 0.0])
    return np.clip(regulator.feedback(x) / task.torque, -1.0, 1.0).astype(np.float32)


print(rigid_envs.evaluate(env_id, linear, name="my LQR"))

# %% [markdown]
# ## Region of attraction
#
# The proof holds for small $x$ and without limits of the torque. With limits, the departures that can be caught are
# bounded. To first order the growing part of $x$ is $d = x_1 - r x_3$ with $r^2 = I_3 (I_3 - I_2) / I_1 (I_2 - I_1)$,
# and $\dot d = \lambda d + (\tau_1 / I_1 - r \tau_3 / I_3)$: no feedback at all stops a $d$ beyond
#
# $$
# d_\text{max} = \frac{\tau_\text{max}}{\lambda} \left( \frac{1}{I_1} + \frac{r}{I_3} \right) .
# $$
#
# We try many directions in the plane of $x_1$ and $x_3$. A start counts as caught if $\omega_2$ stays positive and the
# spin is reached.


# %%
def step(y: np.ndarray) -> np.ndarray:
    """One control period of the closed loop, limits included."""
    x = system.omega_body(y) - [0.0, task.spin_rate, 0.0]
    torque = np.clip(regulator.feedback(x), -task.torque, task.torque)
    return system.advance(y, torque, task.dt, task.n_substeps)


def caught(x: np.ndarray) -> np.ndarray:
    """Whether the closed loop returns to the spin from departures (x1, x3) without a flip."""
    omega = np.stack([x[..., 0], np.full(x.shape[:-1], task.spin_rate), x[..., 1]], axis=-1)
    path = system.omega_body(simulate_closed_loop(step, system.state(omega_body=omega), 300))
    missed = np.linalg.norm(path[-1] - [0.0, task.spin_rate, 0.0], axis=-1)
    return (path[..., 1].min(axis=0) > 0.0) & (missed < 0.05)


angles = np.linspace(0.0, 2.0 * np.pi, 181)
directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
reach = region_of_attraction(caught, directions, np.linspace(0.02, 1.6, 80))

I1, I2, I3 = system.moments
r = np.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))
growth = np.linalg.eigvals(A).real.max()
d_max = task.torque / growth * (1.0 / I1 + r / I3)
print(f"linear limit d_max = {d_max:.3f} rad/s")

figure, axes = plt.subplots(figsize=(4.6, 4.2), layout="constrained")
axes.fill(*(reach[:, None] * directions).T, color="C0", alpha=0.3, label="caught by the LQR")
x3 = np.array([-1.6, 1.6])
for side in (-1.0, 1.0):
    axes.plot(
        side * d_max + r * x3, x3, "k--", label=r"$|d| = d_\mathrm{max}$" if side > 0 else None
    )
axes.set(xlabel="$x_1$ [rad/s]", ylabel="$x_3$ [rad/s]", xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
axes.legend(loc="upper left")
plt.show()

# %% [markdown]
# ## Nonlinear model predictive control
#
# From further away the LQR pushes with full torque against a flip that it cannot stop. What could be done instead is
# a problem of optimal control: the same cost, but the nonlinear motion and the limits of the torque as constraints,
# and the cost to go of the LQR after the horizon,
#
# $$
# \min_{\tau_0 \ldots \tau_{N-1}} \sum_{k=0}^{N-1} \bigl( x_k^T Q x_k + \tau_k^T R \tau_k \bigr) + x_N^T P x_N, \qquad
# \omega_{k+1} = \Phi(\omega_k, \tau_k), \quad |\tau_{k,i}| \le \tau_\text{max} .
# $$
#
# Near the spin, where neither the limits nor the nonlinear terms matter, its solution is the LQR.
#
# `system.symbolic()` gives $\Phi$, the integrator step of the environment, as a function of
# [CasADi](https://web.casadi.org), with all derivatives. It is made of the same source as the compiled one, so that
# the plan is what happens. IPOPT solves the problem.

# %%
import casadi as ca

HORIZON = 60
advance = system.symbolic().step(task.dt, task.n_substeps)
opti = ca.Opti()
omegas, torques = opti.variable(3, HORIZON + 1), opti.variable(3, HORIZON)
first = opti.parameter(3)
opti.subject_to(omegas[:, 0] == first)
opti.subject_to(opti.bounded(-task.torque, ca.vec(torques), task.torque))
for k in range(HORIZON):
    y_next = advance(ca.vertcat(1.0, 0.0, 0.0, 0.0, omegas[:, k]), torques[:, k])
    opti.subject_to(omegas[:, k + 1] == y_next[rates.start : rates.stop])
x = omegas - ca.repmat(ca.DM([0.0, task.spin_rate, 0.0]), 1, HORIZON + 1)
tail = ca.bilin(ca.DM(regulator.riccati), x[:, -1], x[:, -1])
opti.minimize(ca.sumsqr(x[:, :-1]) + 0.03 * ca.sumsqr(torques) + tail)
opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})


def planned(y: np.ndarray) -> np.ndarray:
    """First torque of the plan from a state; the plan before it is where the search begins."""
    opti.set_value(first, system.omega_body(y))
    found = opti.solve()
    opti.set_initial(omegas, found.value(omegas)[:, [*range(1, HORIZON + 1), HORIZON]])
    opti.set_initial(torques, found.value(torques)[:, [*range(1, HORIZON), HORIZON - 1]])
    return np.asarray(found.value(torques)[:, 0])


def regulated(y: np.ndarray) -> np.ndarray:
    """Torque of the regulator, within its limits."""
    departure = system.omega_body(y) - [0.0, task.spin_rate, 0.0]
    return np.clip(regulator.feedback(departure), -task.torque, task.torque)


# %% [markdown]
# In every control period the problem is solved again from where the body is, and the first torque of the plan is
# applied: that is what makes it feedback. We begin outside of the region of attraction.

# %%
start = np.array([0.45, task.spin_rate, -0.45])
print(f"d = {start[0] - r * start[2]:.2f} rad/s, d_max = {d_max:.2f} rad/s")
figure, panels = plt.subplots(
    2, 2, figsize=(7.4, 4.2), sharex=True, sharey="row", layout="constrained"
)
for column, (name, law) in enumerate({"LQR, within limits": regulated, "NMPC": planned}.items()):
    y, path, applied = system.state(omega_body=start), [start], []
    for _ in range(250):
        applied.append(law(y))
        y = system.advance(y, applied[-1], task.dt, task.n_substeps)
        path.append(system.omega_body(y))
    path, applied = np.array(path), np.array(applied)
    missed = path - [0.0, task.spin_rate, 0.0]
    cost = (missed**2).sum() + 0.03 * (applied**2).sum()
    impulse = task.dt * np.linalg.norm(applied, axis=1).sum()
    print(f"{name:20} cost {cost:6.1f}   impulse {impulse:.2f} N m s")
    times = task.dt * np.arange(251)
    panels[0, column].plot(times, path, label=[r"$\omega_1$", r"$\omega_2$", r"$\omega_3$"])
    panels[0, column].set(title=name)
    panels[1, column].step(times[:-1], applied, where="post")
    panels[1, column].set(xlabel="time [s]")
panels[0, 0].set(ylabel=r"$\omega$ [rad/s]")
panels[1, 0].set(ylabel="torque [N m]")
panels[0, 1].legend(loc="lower right")
plt.show()

# %% [markdown]
# Nothing proves that a plan is the best one, for the problem is not convex, nor that the loop is stable; the LQR at
# the end of the horizon makes it plausible. It costs a solver in every period, where the LQR costs nine products and
# a learnt policy some thousands.
