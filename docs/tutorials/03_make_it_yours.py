# %% [markdown]
# # Your own reward, randomisation and start states
#
# Everything that defines a task is an argument of `gym.make`: physical parameters, tolerances, weights of the
# reward terms, noise, delay. No subclass is needed for a variation, and a wrong argument is refused by name.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import rigid_envs
from rigid_envs.scores import from_controller, reference_controllers

env_id = "RigidEnvs/SleepingTop-v0"

# %% [markdown]
# ## Arguments
#
# `rigid-envs describe SleepingTop` prints all of them, with units and what is allowed; so does
# [the page](../environments/SleepingTop.md). The task keeps them, as a frozen dataclass.

# %%
task = gym.make(env_id, start_tilt=0.4, torque=0.5).unwrapped.task
print(task)
try:
    gym.make(env_id, start_tilt=-0.4)
except ValueError as error:
    print("refused:", error)

# %% [markdown]
# ## Rewards
#
# A reward is a sum of named terms with weights. Terms are bounded and unweighted in `info`; the weights are
# arguments `weight_<term>`. A reward that cares for effort alone, or for the tilt alone, is two numbers:

# %%
print("terms:", task.terms)
for weights in ({}, {f"weight_{term}": 0.0 for term in task.terms[1:]}):
    env = gym.make(env_id, **weights)
    env.reset(seed=0)
    _, reward, _, _, info = env.step(np.array([0.5, 0.0], dtype=np.float32))
    terms = {key: round(value, 4) for key, value in info.items() if key.startswith("reward/")}
    print(f"reward {reward:.4f} of {terms}")

# %% [markdown]
# What cannot be said by weights is a wrapper, as with any environment. The terms of `info` and
# `env.unwrapped.system` (its energy, its momentum) are there to be used. Here a reward that asks for a small
# kinetic energy of the fall:


# %%
class CalmReward(gym.Wrapper):
    """Reward minus the horizontal part of the rotational energy [J]."""

    def step(self, action):
        """Step, and take the energy from the reward."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        system = self.unwrapped.system
        falling = system.omega_body(self.unwrapped.y)[:2]
        reward -= 0.5 * system.I1 * float(falling @ falling)
        return observation, reward, terminated, truncated, info


env = CalmReward(gym.make(env_id))
env.reset(seed=0)
print("with the wrapper", env.step(env.action_space.sample())[1])

# %% [markdown]
# ## Randomisation
#
# Every physical parameter takes a number or a range `(low, high)`, from which each reset draws; noise and delay
# do likewise. `observe_params=True` appends what was drawn to the observation. In a vector environment each row
# draws for itself.

# %%
envs = gym.make_vec(
    env_id,
    num_envs=512,
    m=(0.8, 1.2),
    ell=(0.08, 0.12),
    action_noise=0.05,
    action_delay=(0, 2),
    observe_params=True,
)
observations, _ = envs.reset(seed=0)
print("observation without parameters:", gym.make(env_id).observation_space.shape)
print("and with them:                 ", observations.shape)

figure, axes = plt.subplots(figsize=(4.2, 2.8), layout="constrained")
axes.plot(*observations[:, -3:-1].T, ".", markersize=3)
axes.set(xlabel="m [kg]", ylabel="ell [m]", title="What 512 rows drew, as observed")
plt.show()

# %% [markdown]
# A controller that was designed for the nominal top then has to be robust. The regulator of this environment
# is told the parameters of each episode; what noise and delay cost it is measured with `config`:

# %%
for config in ({}, {"action_noise": 0.5}, {"action_delay": 5}, {"action_delay": 10}):
    result = rigid_envs.evaluate(env_id, "reference", n=100, config=config)
    print(f"{config!s:24} success {100 * result.success.mean:5.1f} %")

# %% [markdown]
# ## Start states
#
# `reset(options={"state": ...})` starts where you say, by named components; what you leave out is drawn as
# usual. `"params"` does the same for parameters. `get_state` and `set_state` copy everything, the random stream
# included, and continue to the bit.

# %%
env = gym.make(env_id)
tilt = 0.3
q = [np.cos(0.5 * tilt), np.sin(0.5 * tilt), 0.0, 0.0]
env.reset(seed=0, options={"state": {"q": q}, "params": {"m": 1.1}})
print(
    "tilt [rad]:", env.unwrapped.system.tilt(env.unwrapped.y), " mass [kg]:", env.unwrapped.system.m
)

kept = env.unwrapped.get_state()
first = [env.step(np.zeros(2, dtype=np.float32))[1] for _ in range(5)]
env.unwrapped.set_state(kept)
second = [env.step(np.zeros(2, dtype=np.float32))[1] for _ in range(5)]
print("the same rewards again:", first == second)

# %% [markdown]
# Starts on a grid show where a controller works. One row of a vector environment for each tilt, and the
# reference controller of the task for all rows at once:

# %%
tilts = np.linspace(0.01, 1.0, 100)
half = 0.5 * tilts[:, None]
q = np.hstack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
envs = gym.make_vec(env_id, num_envs=len(tilts), start_spin_low=0.5, start_spin_high=0.5)
name, controller = next(iter(reference_controllers(env_id).items()))
act = from_controller(controller)(envs)
observations, _ = envs.reset(seed=0, options={"state": {"q": q}})
for _ in range(envs.spec.max_episode_steps):
    observations, _, _, _, infos = envs.step(act(observations))
success = infos["is_success"]
print(
    f"{name}, at half the critical spin, holds every top up to {tilts[np.argmin(success) - 1]:.2f} rad"
)

# %% [markdown]
# ## More
#
# - A new task on an existing system: [the next tutorial](04_your_own_environment.py).
# - Settings that hold in training alone: [training](../training.md).
