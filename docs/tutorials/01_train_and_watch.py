# %% [markdown]
# # Train and watch
#
# A rigid body turns steadily about its axes of least and of largest moment of inertia. About the
# intermediate axis $e_2$ it does not: the smallest disturbance grows until the body tumbles. In
# `IntermediateAxis` an agent holds that spin by small torques. We train PPO for half a minute,
# measure what it has learnt, and watch it.
#
# This page is a script: `python docs/tutorials/01_train_and_watch.py`. It needs
# `pip install -e '.[train,render,docs]'`.

# %%
import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np
import torch
from IPython.display import Video
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

import rigid_envs
from rigid_envs.scores import from_controller, from_predict, reference_controllers
from rigid_envs.watch.drawing import Look
from rigid_envs.watch.films import episode_pictures, play_episode, write_film

torch.set_num_threads(1)  # fastest for networks of this size
env_id = "RigidEnvs/IntermediateAxis-v0"

# %% [markdown]
# ## The environment
#
# The observation is the angular velocity over the commanded rate, $\omega / \Omega$, in body axes;
# the action is a torque about each of them. `info` has the terms of the reward by name, without
# their weights, and what the step has cost: here an impulse, in N m s.

# %%
env = gym.make(env_id)
observation, info = env.reset(seed=0)
print("start      ", observation)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
print("first step ", observation, f"reward {reward:.3f}")
print(info)

# %% [markdown]
# Without torque the spin is lost. The three components of $\omega$ follow Euler's equations; the
# [lecture on the Dzhanibekov effect](06_dzhanibekov.py) is about them.

# %%
observations = [env.reset(seed=0)[0]]
while len(observations) <= 300:
    observations.append(env.step(np.zeros(3, dtype=np.float32))[0])
times = env.unwrapped.task.dt * np.arange(len(observations))

figure, axes = plt.subplots(figsize=(7, 2.6), layout="constrained")
axes.plot(times, observations, label=["$e_1$", "$e_2$", "$e_3$"])
axes.set(xlabel="time [s]", ylabel=r"$\omega / \Omega$", title="Without torque")
axes.legend(loc="right")
plt.show()

# %% [markdown]
# ## Training
#
# `frame="reduced"` observes what no [symmetry](../symmetry.md) of the task changes: turning the
# body by half a turn about one of its axes gives the same problem, so a policy need learn it once.
# The rest is Stable-Baselines3 as always.

# %%
settings = {"frame": "reduced"}
venv = make_vec_env(env_id, n_envs=16, seed=0, env_kwargs=settings)
model = PPO(
    "MlpPolicy",
    venv,
    n_steps=256,
    batch_size=1024,
    gamma=0.98,
    policy_kwargs={"log_std_init": -1.0},
    seed=0,
    device="cpu",
)
model = model.learn(total_timesteps=150_000)

# %% [markdown]
# ## Evaluation
#
# `evaluate` plays one episode from each of 500 starts that no training has seen. `success` says how
# often, `efficiency` how well: for each start, the best known cost over the cost of the policy, and 0
# where it failed. The reference is a linear-quadratic regulator (LQR), which knows the equations.

# %%
trained = rigid_envs.evaluate(env_id, model, config=settings)
reference = rigid_envs.evaluate(env_id, "reference")
random = rigid_envs.evaluate(env_id, "random")
for result in (trained, reference, random):
    print(result, end="\n\n")

# %% [markdown]
# To hold the spin is learnt soon. To do so at little cost is not: the efficiency compares the impulses. A
# policy that was trained for longer, by the recipe of this repository, comes with the package and runs without
# torch.

# %%
published = rigid_envs.evaluate(env_id, rigid_envs.load("IntermediateAxis"))
shown = {"random": random, "PPO, here": trained, "PPO, published": published, "LQR": reference}
figure, axes = plt.subplots(figsize=(7, 2.6), layout="constrained")
axes.barh(list(shown), [result.success.mean for result in shown.values()], color="0.85")
axes.barh(list(shown), [result.efficiency.mean for result in shown.values()], height=0.4)
axes.set(xlim=(0, 1), xlabel="success (grey) and efficiency (blue)")
plt.show()

# %% [markdown]
# ## Watch
#
# Both play the same start, shown three times as fast.

# %%
both = [
    play_episode(from_predict(model), env_id, seed=1007, config=settings, label="PPO"),
    play_episode(
        from_controller(reference_controllers(env_id)["lqr"]), env_id, seed=1007, label="LQR"
    ),
]
episodes = [played.captioned() for played in both]
pictures = episode_pictures(episodes, Look(320, 320), fps=15.0, speed=3.0)
film = write_film("both.mp4", pictures, fps=15.0)
Video(film.path, embed=True, html_attributes="controls loop muted autoplay")

# %% [markdown]
# ## More
#
# `python -m agents` trains with the recipes of this repository: the flagship task `BallPark` without
# a word, any other with `train --env_id ID`; it resumes, evaluates and films by itself. See
# [training](../training.md), [watching](../watching.md) and the [baselines](../baselines.md).
