"""Critics against true values: what PPO's value network has learnt, and when."""

import itertools
from typing import Any, NamedTuple

import numpy as np
import torch
from scipy.sparse import csr_array
from scipy.stats import spearmanr

from rigid_envs.base.files import markdown_table
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.leaderboard import INK, MUTED, dress, look, new_figure
from rigid_envs.scores.policies import system_of
from rigid_envs.scores.starts import row_seeds
from rigid_envs.systems.rolling_ball.controllers import QuarterRolls
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.benchmarks.studies.jobs import train

IDS = ("Detumble", "RollPump", "BallGrid")
STEPS, N_LOOKS = 400_000, 12
GAMMA = {"Detumble": 0.99, "RollPump": 0.98, "BallGrid": 0.97}
LAMBDA, N_ROWS, N_STEPS = 0.95, 128, 64
_ENTRIES = {
    **{"n_envs": N_ROWS, "n_steps": N_STEPS, "batch_size": 1024, "n_epochs": 8},
    **{"gae_lambda": LAMBDA, "learning_rate": [1e-3, 1e-4], "net_arch": [64, 64]},
    **{"train_kwargs": {}, "cost_price": 0.0, "success_bonus": 0.0, "normalize_reward": False},
    "log_std_init": -1.0,
}
_LEFT = 1e-4  # of a reward at the end of a simulated return


def jobs(quick):
    """Trainings of each environment."""
    few = {"states": 8, "copies": 2, "looks": 1, "grid": 21}
    more = few if quick else {"states": 256, "copies": 16, "looks": N_LOOKS, "grid": 201}
    return [
        {"name": f"{env_id}_{seed}", "env_id": env_id, "seed": seed,
         "steps": 1 if quick else STEPS, **more}
        for env_id, seed in itertools.product(IDS, range(1, 2 if quick else 6))
    ]  # fmt: skip


def work(job):
    """The critic beside returns of its policy and least costs, at several ages."""
    env_id, gamma = f"RigidEnvs/{job['env_id']}-v0", GAMMA[job["env_id"]]
    exact = {"Detumble": _of_detumble, "BallGrid": _of_ball_grid}
    known = exact[job["env_id"]](gamma) if job["env_id"] in exact else Plane(gamma, job["grid"])
    looks = _Looks(job, known)
    # one update more: what the buffer shows of the last critic comes with the one after it
    train({"env_id": env_id, "seed": job["seed"], "total_timesteps": job["steps"] + 1, **_ENTRIES,
           "action_std": None, "gamma": gamma}, looks)  # fmt: skip
    return {"looks": [look for look in looks.found if "visible" in look]}


class _Looks:
    """Looks at a training: called before the first update and after every one."""

    def __init__(self, job, optimal):
        self.found, self._job, self._optimal, self._calls = [], job, optimal, 0
        updates = max(job["steps"] // (N_ROWS * N_STEPS), 1)
        self._due = {round(k * updates / job["looks"]) for k in range(job["looks"] + 1)}

    def __call__(self, trainer):
        model, number = trainer.model, self._calls
        self._calls += 1
        if self.found and self.found[-1]["update"] == number - 1:
            self.found[-1] |= _visible(model.rollout_buffer)
        if number in self._due:
            seen, y, returns = _simulated(self._job, model, number)
            value = model.policy.predict_values(torch.as_tensor(seen)).detach().numpy()[:, 0]
            looked = {"value": value, "own": returns, "optimal": self._optimal(y)}
            figures = {name: np.round(x, 6).tolist() for name, x in looked.items()}
            self.found.append({"update": number, "timesteps": model.num_timesteps, **figures})


def _visible(buffer):
    """What the learner sees of its critic: targets less values, and the variance explained."""
    off = buffer.returns - buffer.values
    explained = 1.0 - off.var() / buffer.returns.var()
    return {"visible": float(off.mean()), "explained": float(explained)}


def _simulated(job, model, number):
    """States of episodes under the policy, and its mean discounted return from each.

    Returns:
        Observations, physical states, and returns; no time limit ends them.
    """
    env_id, gamma = f"RigidEnvs/{job['env_id']}-v0", GAMMA[job["env_id"]]
    n, copies = job["states"], job["copies"]
    kwargs = {"frame": "reduced"}
    rows = make_rows(env_id, n, kwargs)
    rng = np.random.default_rng(number)
    limit = ENVIRONMENTS[env_id].max_episode_steps
    seen, _ = rows.reset(seed=row_seeds(number, n, "validation"))
    picked, y = rng.integers(limit, size=n), None
    for step in range(limit):
        now = _resting(rows)
        y = now if y is None else np.where((picked == step)[:, None], now, y)
        seen, *_ = rows.step(model.predict(seen, deterministic=False)[0])
    rows = make_rows(env_id, n * copies, kwargs)
    seen, _ = rows.reset(seed=number, options={"state": np.repeat(y, copies, axis=0)})
    first, going = seen[::copies], np.ones(n * copies, bool)
    returns, weight, age = np.zeros(n * copies), 1.0, 0
    while weight > _LEFT and going.any():
        seen, rewards, ended, *_ = rows.step(model.predict(seen, deterministic=False)[0])
        returns += weight * going * rewards
        going &= ~ended
        weight, age = gamma * weight, age + 1
        if age % (limit - 1) == 0:  # just before the time limit, their clocks begin anew
            seen, _ = rows.reset(options={"state": _resting(rows)})
    return first, y, returns.reshape(n, copies).mean(axis=1)


def _resting(rows):
    """States from which the same follows as from those of the rows, with nothing beside them.

    A change of the ratio of `RollPump` keeps the momentum: its states are those at the least ratio.
    """
    y = np.array(rows.y)
    if "beta_change" in rows.task.aux_names:
        roller = system_of(rows.task)
        y[:, 1] *= 1.0 + rows.auxiliary("beta_change") / (1.0 + roller.beta)
    return y


# Optimal values at the rewards and the discount of the training.


def _of_detumble(gamma):
    """The root of the scalar Riccati equation: ``P = b (a + gamma P) / (a + b + gamma P)``."""
    task: Any = task_of("RigidEnvs/Detumble-v0")
    a = task.weight_momentum / task.start_momentum**2
    b = task.weight_impulse / task.impulse**2
    half = 0.5 * (a + b - gamma * b)
    P = (np.sqrt(half**2 + gamma * a * b) - half) / gamma
    body = system_of(task)
    return lambda y: -P * np.sum(body.L_body(y) ** 2, axis=-1)


def _of_ball_grid(gamma):
    """From the fewest moves home, by breadth-first search."""
    task: Any = task_of("RigidEnvs/BallGrid-v0")
    rolls = QuarterRolls(system_of(task), 40)

    def value(y):
        n = rolls.moves(y)
        n = np.where(n == 0, 2, n)  # out, and back
        paid = (1.0 - gamma**n) / (1.0 - gamma)
        return task.weight_home * gamma ** (n - 1.0) - task.weight_moves * paid

    return value


class Plane:
    """Optimal values of `RollPump`: on a grid of angle and velocity at the least ratio.

    Each of three actions is a step of the environment itself from every point, and values between
    points are bilinear. A call gives the values of states y at the least ratio, shape (N, 2).

    Args:
        gamma: discount of a period.
        n: number of points along each axis.
    """

    def __init__(self, gamma, n):
        """Iterate until the value changes by less than 1e-6."""
        self._n = n
        points = np.stack(np.meshgrid(*self._axes(), indexing="ij"), axis=-1).reshape(-1, 2)
        rows = make_rows("RigidEnvs/RollPump-v0", len(points))
        parts = []
        for action in (-1.0, 0.0, 1.0):
            rows.reset(seed=0, options={"state": points})
            given = np.full((len(points), 1), action, np.float32)
            _, reward, ended, _, _ = rows.step(given)
            parts.append((reward, gamma * ~ended, self._weights(_resting(rows))))
        value, change = np.zeros(len(points)), 1.0
        while change > 1e-6:
            new = np.max([reward + going * (w @ value) for reward, going, w in parts], axis=0)
            change, value = np.abs(new - value).max(), new
        self._values = value

    def __call__(self, y):
        """Values of states."""
        return self._weights(y) @ self._values

    def _axes(self):
        task: Any = task_of("RigidEnvs/RollPump-v0")
        roller = system_of(task)
        fastest = 2.0 * np.sqrt(roller.g / roller.curvature / (1.0 + roller.beta))
        angles = np.linspace(-task.rim, task.rim, self._n) / roller.curvature
        return angles, 1.2 * fastest * np.sin(0.5 * task.rim) * np.linspace(-1.0, 1.0, self._n)

    def _weights(self, y):
        """Sparse matrix from values on the grid to those at states; clipped to its edges."""
        place = [np.interp(x, axis, np.arange(self._n)) for x, axis in zip(y.T, self._axes(),
                                                                          strict=True)]  # fmt: skip
        low = [np.minimum(p.astype(int), self._n - 2) for p in place]
        part = [p - k for p, k in zip(place, low, strict=True)]
        corners = itertools.product((0, 1), repeat=2)
        entries = [
            (np.abs(1 - i - part[0]) * np.abs(1 - j - part[1]), (low[0] + i) * self._n + low[1] + j)
            for i, j in corners
        ]
        weights, columns = (np.concatenate(each) for each in zip(*entries, strict=True))
        index = np.tile(np.arange(len(y)), 4)
        return csr_array((weights, (index, columns)), shape=(len(y), self._n**2))


def hidden_share(gamma, trace=LAMBDA, n_steps=N_STEPS):
    """Share of a uniform error of the critic that its targets show, without any end of an episode.

    A target m steps before the end of the buffer is ``V + sum of (gamma trace)^k delta_k`` over m
    terms, each of them -(1 - gamma) times the error; the mean over m is taken.
    """
    q = gamma * trace
    m = np.arange(1, n_steps + 1)
    return float(np.mean((1.0 - gamma) * (1.0 - q**m) / (1.0 - q)))


# What the page says.


class Figures(NamedTuple):
    """Figures of a critic at one age.

    `bias` is its value less the own return of the policy, `own` and `best` its rank correlations
    with that return and with the optimal value, `regret` what the return is below the optimum, all
    differences over the standard deviation of the return; `explained` the variance of the return
    that it explains, `said` what the learner says of it, `inferred` the bias that its targets show.
    """

    bias: float
    own: float
    best: float
    regret: float
    explained: float
    said: float
    inferred: float


def figures_of(look, gamma):
    """Of a look of a record; all NaN where the policy has the same return from all states."""
    value, own, optimal = (np.array(look[name]) for name in ("value", "own", "optimal"))
    scale = own.std()
    if scale < 1e-9 * np.abs(own).max():  # rounding alone
        return Figures(*[np.nan] * len(Figures._fields))
    return Figures(
        bias=float((value - own).mean() / scale),
        own=float(spearmanr(value, own)[0]),
        best=float(spearmanr(value, optimal)[0]),
        regret=float((optimal - own).mean() / scale),
        explained=float(1.0 - (value - own).var() / own.var()),
        said=look["explained"],
        inferred=float(-look["visible"] / hidden_share(gamma) / scale),
    )


def curves_of(found):
    """By environment: steps of the looks, and `Figures`, shape (seeds, looks, figures)."""
    curves = {}
    for record in found:
        env_id, looks = record["job"]["env_id"], record["found"]["looks"]
        rows = [figures_of(look, GAMMA[env_id]) for look in looks]
        curves.setdefault(env_id, ([look["timesteps"] for look in looks], []))[1].append(rows)
    return {env_id: (steps, np.array(rows)) for env_id, (steps, rows) in curves.items()}


def results(found):
    """Table of the critics over training, and the claims."""
    lines = []
    curves = curves_of(found)
    for env_id, (steps, figures) in curves.items():
        for k in sorted({0, len(steps) // 4, len(steps) // 2, len(steps) - 1}):
            mean = [f"{x:.2f}" for x in np.nanmean(figures[:, k], axis=0)]
            lines.append((f"`{env_id}`", f"{steps[k]:,}", *mean))
    header = ("environment", "steps", "bias", "rank, own", "rank, optimal", "regret",
              "explained", "said", "inferred")  # fmt: skip
    return "\n\n".join([_TABLE, markdown_table(header, lines, "<" + ">" * 8), _verdicts(found)])


_TABLE = """Means over the seeds. Bias, regret and the bias that is inferred from the targets are in
standard deviations of the return; a policy with the same return from all states is left out."""


def _verdicts(found):
    curves, lines = curves_of(found), []
    if "Detumble" in curves:
        later = Figures(*curves["Detumble"][1][:, 1:].reshape(-1, len(Figures._fields)).T)
        large = np.abs(later.bias) > 0.1
        ratio = np.median(later.inferred[large] / later.bias[large]) if large.any() else np.nan
        lines.append(
            f"- Claim 1. `Detumble`: inferred over true bias, median of {large.sum()} looks "
            f"with a bias above 0.1: {ratio:.2f}."
        )
    for env_id in curves:
        gains, biases = _lags([each for each in found if each["job"]["env_id"] == env_id])
        if env_id in IDS[1:] and len(gains) > 1:
            rank = spearmanr(gains, biases)[0]
            lines.append(f"- Claim 2. `{env_id}`: rank correlation of gain and bias {rank:.2f}.")
    for env_id, (_, each) in curves.items():
        first = [[_first(rows[:, 1] >= 0.9), _first(np.abs(rows[:, 0]) <= 0.1)] for rows in each]
        kept = sum(rank <= level for rank, level in first)
        lines.append(f"- Claim 3. `{env_id}`: rank not later than level in {kept} of {len(each)}.")
    return "\n".join(sorted(lines))


def _lags(found):
    """Improvements of the mean return since the look before, and mean biases."""
    gains, biases = [], []
    for record in found:
        levels, values = (np.mean([look[name] for look in record["found"]["looks"]], axis=1)
                          for name in ("own", "value"))  # fmt: skip
        gains += np.diff(levels).tolist()
        biases += (values - levels)[1:].tolist()
    return gains, biases


def _first(reached):
    """Number of the first look that has reached it; that of all looks, if none has."""
    return int(np.argmax(reached)) if reached.any() else len(reached)


def draw(found):
    """Bias, rank correlation and explained variance over training, a column for each."""
    curves = curves_of(found)
    figure = new_figure(9.0, 3.2, 110)
    panels = figure.subplots(1, 3)
    shown = {
        "bias (dotted: inferred)": ("bias", "inferred"),
        "rank, own return (dotted: optimum)": ("own", "best"),
        "explained (dotted: said)": ("explained", "said"),
    }
    for axes, (title, names) in zip(panels, shown.items(), strict=True):
        for number, (env_id, (steps, figures)) in enumerate(curves.items()):
            for name, style in zip(names, ("-", ":"), strict=True):
                column = np.nanmean(figures[:, :, Figures._fields.index(name)], axis=0)
                label = env_id if style == "-" else None
                thousands = np.array(steps) / 1000.0
                axes.plot(thousands, column, style, color=look(number)[0], label=label)
        axes.set_title(title, loc="left", fontsize=9, color=INK)
        axes.set_xlabel("thousand steps", color=MUTED)
        dress(axes, "")
    panels[0].set_yscale("symlog", linthresh=1.0)
    panels[2].set_ylim(-1.0, 1.05)
    panels[1].legend(frameon=False, fontsize=8)
    return figure
