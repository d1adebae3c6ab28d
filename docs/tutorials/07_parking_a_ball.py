# %% [markdown]
# # Lecture: parking a ball
#
# Put a ball on a table and roll it with a flat hand, without slipping and without spinning it. You have
# two controls, the velocity of its centre. The ball has five coordinates: two for its place, three for its
# attitude. Can you bring it to any place in any attitude? Yes, though no combination of the two velocities
# turns it on the spot. This lecture says how, what it costs, and what the shortest way looks like.

# %%
import matplotlib.pyplot as plt
import numpy as np

import rigid_envs
from rigid_envs import rotations
from rigid_envs.scores import best_known, from_predict
from rigid_envs.systems import RollingBall
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import three_rolls
from rigid_envs.systems.rolling_ball.shortest_path import shortest_path
from rigid_envs.watch.films import play_episode

ball = RollingBall(radius=1.0)

# %% [markdown]
# ## The constraint
#
# Rolling without slipping: the point of contact is at rest, $v = \omega \times r e_z$, and without spin
# about the vertical
#
# $$
# \omega = \frac{1}{r} (-V_Y, V_X, 0), \qquad \dot X = V_X, \quad \dot Y = V_Y, \qquad
# \dot q = \tfrac{1}{2} (0, \omega)\, q .
# $$
#
# The velocities obey two linear equations that cannot be integrated to equations between coordinates: the
# constraint is *nonholonomic*. Rolling out and back along a line changes nothing. Rolling round a closed
# path brings the centre back, but not the attitude: that change is the *holonomy* of the path.

# %%
side = 0.5
square = side * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
y = ball.state()
for roll in square:
    y = ball.advance(y, [*roll, 0.0], 1.0, 4)  # one second at this velocity
print("place after the square  ", np.round(ball.position(y), 12))
print("rotation vector [rad]   ", rotations.log(y[:4]))
print("minus area / radius^2   ", -(side**2))

# %% [markdown]
# ## Small loops
#
# Round a small counter-clockwise loop of area $A$ the ball turns by about $-A / r^2$ about the vertical.
# For a circle of radius $\varrho r$ the closed form is known: the ball turns by
# $2\pi(\sqrt{1 + \varrho^2} - 1)$ about an axis that tends to the vertical as $\varrho \to 0$. To turn by
# half a turn on the spot is thus a matter of one circle.

# %%
rho = np.logspace(-2, 0.5, 60)
turned = rotations.log(rolling_ball.circle_holonomy(rho, 1.0))

figure, axes = plt.subplots(figsize=(7, 2.8), layout="constrained")
axes.loglog(rho, np.linalg.norm(turned, axis=-1), label="angle of the turn")
axes.loglog(rho, np.abs(turned[:, 2]), label="of it, about the vertical")
axes.loglog(rho, np.pi * rho**2, "k--", label=r"$A / r^2$")
axes.set(xlabel=r"radius of the circle [radii of the ball]", ylabel="turn [rad]")
axes.legend()
plt.show()

# %% [markdown]
# The second curve bends down where whole turns begin to count: the rotation vector is that of the least
# angle. At $\varrho = \sqrt 3$ a circle turns the ball by $2\pi$, which is nothing at all.
#
# ## Lie brackets
#
# Why a loop? Write the motion as $\dot x = V_X\, f(x) + V_Y\, g(x)$. Roll along $f$, then $g$, then back
# along $f$, then back along $g$, each for a time $\varepsilon$. To second order
#
# $$
# x \mapsto x + \varepsilon^2\, [f, g](x) + O(\varepsilon^3), \qquad
# [f, g] = \frac{\partial g}{\partial x} f - \frac{\partial f}{\partial x} g .
# $$
#
# Here $[f, g]$ is a spin about the vertical: the square above. Brackets with brackets give more:
# $[f, [f, g]]$ and $[g, [f, g]]$ are tilts about horizontal axes without displacement, of order
# $\varepsilon^3$. The dimensions that are spanned up to each depth are the *growth vector*.

# %%
fields = rolling_ball.ball_fields(1.0)
somewhere = [0.3, -0.2, *rotations.exp([0.4, -0.7, 0.2])]
growth = rolling_ball.growth_vector(fields, somewhere, depth=3)
print("growth vector              ", growth)
print("degree of nonholonomy      ", rolling_ball.degree_of_nonholonomy(growth, 5))

# %% [markdown]
# By the theorem of Chow and Rashevskii, five dimensions at depth three mean that every pose can be reached,
# and that it is expensive to reach what only deep brackets reach: a displacement of size $\varepsilon$ takes
# a path of length $\varepsilon$, a spin $\sqrt\varepsilon$, a pure tilt $\sqrt[3]\varepsilon$. The reward of
# [`BallPark`](../environments/BallPark.md) measures distances by these roots. We check them with shortest
# paths.

# %%
sizes = np.logspace(-3, -0.5, 6)
home = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def length(rotation: np.ndarray, place: np.ndarray) -> float:
    """Length of the shortest path to a pose."""
    return shortest_path(home, np.concatenate([rotations.exp(rotation), place])).length


zero, along_x, up = np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 0.0, 1.0])
directions = {
    "rolled displacement": lambda e: length(e * np.array([0.0, 1.0, 0.0]), e * along_x),
    "spin": lambda e: length(e * up, zero),
    "tilt": lambda e: length(e * np.array([0.0, 1.0, 0.0]), zero),
}
figure, axes = plt.subplots(figsize=(7, 2.8), layout="constrained")
for name, path_length in directions.items():
    lengths = [path_length(size) for size in sizes]
    slope = np.polyfit(np.log(sizes), np.log(lengths), 1)[0]
    axes.loglog(sizes, lengths, "o-", label=f"{name}: slope {slope:.3f}")
axes.set(xlabel="size of the change [radii, rad]", ylabel="shortest path [radii]")
axes.legend()
plt.show()

# %% [markdown]
# ## Three rolls
#
# Kendall asked his students in Oxford in the 1950s: how many straight rolls does it take? Hammersley
# showed that three always suffice and two do not. There are four unknowns after the displacement is
# fixed, and three equations for the attitude; `three_rolls` solves them by Newton's method and takes the
# shortest of the plans that it finds.
#
# ## The shortest path
#
# The shortest path is a problem of optimal control: minimise $\int |V|\, dt$. Pontryagin's maximum
# principle gives an equation for the heading $a$ of the path as a function of its arc length,
#
# $$
# X' = \cos a, \qquad Y' = \sin a, \qquad a'' = p_Y \cos a - p_X \sin a
# $$
#
# with a constant vector $p$. That is the equation of a pendulum, and of a bent elastic rod: the centre of the
# ball runs along one of Euler's *elasticae* (Arthurs & Walsh 1986, Jurdjevic 1993). `shortest_path` finds
# the four numbers heading, curvature and $p$ by shooting. The learnt policy knows none of this. It was
# trained by PPO, from the reward alone.

# %%
env_id = "RigidEnvs/BallPark-v0"
policy = rigid_envs.load("BallPark")
seeds = (1, 4, 6)
figure, panels = plt.subplots(1, 3, figsize=(7.6, 3.0), layout="constrained")
for seed, axes in zip(seeds, panels, strict=True):
    played = play_episode(from_predict(policy), env_id, seed, config=policy.env_kwargs)
    states = played.episode.y
    elastica = shortest_path(states[0], home)
    corners = np.cumsum([states[0, 4:6], *three_rolls(states[0], home)], axis=0)
    straight = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    axes.plot(*corners.T, "C2", label=f"three rolls {straight:.2f} m")
    axes.plot(*states[:, 4:6].T, "C1", label=f"policy {played.value:.2f} m")
    axes.plot(*elastica.states(200)[:, 4:6].T, "C0", label=f"elastica {elastica.length:.2f} m")
    axes.plot(0.0, 0.0, "ko", markersize=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.12))
    axes.set_title(f"start {seed}", fontsize=9)
plt.show()

# %% [markdown]
# The policy stops where it is within the tolerance, so it can be shorter than the path to the exact pose.
# Over all 500 starts of the evaluation (the figures of the planners are kept in the package, for the
# elasticae of all of them take two minutes):

# %%
known = best_known(env_id).policies
learnt = rigid_envs.evaluate(env_id, policy)
print(f"{'':15} success  efficiency  path")
for who in ("shortest_path", "three_rolls"):
    row = known[who]
    print(
        f"{who:15} {100 * row['success_rate']:5.1f} %    {row['efficiency']:.3f}   "
        f"{row['cost_mean']:.3f} m"
    )
print(
    f"{'policy':15} {100 * learnt.success.mean:5.1f} %    {learnt.efficiency.mean:.3f}   "
    f"{learnt.mean(learnt.costs):.3f} m"
)

# %% [markdown]
# ## Exercises
#
# 1. Show that rolling round a circle of radius $\sqrt 3\, r$ turns the ball by a whole turn.
# 2. Which closed path of given length turns the ball most about the vertical? (Dido's problem.)
# 3. Let the ball spin as well: `ball.advance(y, [VX, VY, spin], ...)`. What is the growth vector then?
# 4. An upright coin has four coordinates and two controls. Compute its growth vector with
#    `rolling_ball.coin_fields` and compare with parking a car.
#
# ## Sources
#
# Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79; Arthurs & Walsh 1986, "On Hammersley's
# minimum problem for a rolling sphere"; Jurdjevic 1993, "The geometry of the plate-ball problem",
# [doi:10.1007/BF00375605](https://doi.org/10.1007/BF00375605); Montgomery, *A Tour of Subriemannian
# Geometries*; Murray, Li & Sastry, *A Mathematical Introduction to Robotic Manipulation*, chapter 7.
