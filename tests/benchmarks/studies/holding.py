"""Hold long, then act fine: training with a longer control period, test with all periods."""

import itertools

import numpy as np

import rigid_envs
from agents.config.reading import recipe_for
from rigid_envs.base.files import markdown_table
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.leaderboard import INK, dress, look, new_figure
from rigid_envs.scores.starts import metrics_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.benchmarks.studies.jobs import train

IMPULSE = ("IntermediateAxis", "SpinCapture", "SleepingTop", "TopPrecession")
"""Environments whose cost is an impulse; those of the others are not: an error, a time."""
OTHERS = ("DiskRoll", "BallPlate")
PERIODS = (1, 2, 4)
STEPS = 400_000
_OF_TRAINING = ("dt", "n_substeps", "max_episode_steps")


def jobs(quick):
    """Trainings of each environment with each period."""
    ids, seeds = (("SleepingTop",), 1) if quick else (IMPULSE + OTHERS, 3)
    return [
        {
            **{"name": f"{env_id}_{k}_{seed}", "env_id": env_id, "period": k, "seed": seed},
            **({"steps": 1, "n": 8} if quick else {"steps": STEPS, "n": 200}),
        }
        for env_id, k, seed in itertools.product(ids, PERIODS, range(1, 1 + seeds))
    ]


def work(job):
    """Success and cost of the policy in each period of test."""
    env_id, k = f"RigidEnvs/{job['env_id']}-v0", job["period"]
    model = train({"env_id": env_id, "seed": job["seed"], "total_timesteps": job["steps"]}
                  | entries_for(env_id, k))  # fmt: skip
    found = {str(period): _tested(env_id, model, period, job["n"]) for period in PERIODS}
    return {"metric": metrics_of(env_id)[0].name, "of_period": found}


def held(env_id, k):
    """Settings of an environment whose actions are held for k control periods.

    Substeps are shorter then, for its check of speed does not know of fewer periods.
    """
    task, limit = task_of(env_id), ENVIRONMENTS[env_id].max_episode_steps
    changed = (k * task.dt, k * k * task.n_substeps, -(-limit // k))
    return dict(zip(_OF_TRAINING, changed, strict=True))


def entries_for(env_id, k):
    """Entries of a training with a control period k times as long, at the same objective.

    Rewards are paid once in a period, impulses for all of it: so the price is divided by k, and the
    discount of a period is that of k short ones. What the recipe says of the period is left out.
    """
    recipe = recipe_for(env_id, "ppo", "reduced")
    price, gamma = recipe.get("cost_price", 0.0), recipe.get("gamma", 0.99)
    kept = {key: value for key, value in recipe.get("train_kwargs", {}).items()
            if key not in _OF_TRAINING}  # fmt: skip
    return {
        "train_kwargs": {**kept, **(held(env_id, k) if k > 1 else {})},
        "cost_price": [each / k for each in price] if isinstance(price, list) else price / k,
        "gamma": gamma**k,
        "policy_gain": 1.0,
        **{"net_arch": [64, 64], "n_envs": 128, "n_steps": 64, "batch_size": 1024, "n_epochs": 5},
    }


def _tested(env_id, model, period, n):
    rows = make_rows(env_id, n, {"frame": "reduced", **held(env_id, period)})
    found = rigid_envs.evaluate(env_id, model, env=rows, n=n)
    rows.close()
    cost = found.values[metrics_of(env_id)[0].name]
    return {"success": found.values["success"].tolist(), "cost": cost.tolist()}


# What the page says.


def cells_of(found):
    """By environment, period of training and of test: success and mean cost of each seed."""
    cells = {}
    for record in found:
        job = record["job"]
        for period, tested in record["found"]["of_period"].items():
            won = np.array(tested["success"]) > 0.0
            cost = float(np.mean(np.array(tested["cost"])[won])) if won.any() else np.nan
            at = (job["env_id"], job["period"], int(period))
            cells.setdefault(at, []).append((float(won.mean()), cost))
    return {at: np.array(pairs) for at, pairs in cells.items()}


def gain_of(cells, env_id, k):
    """Cost at the short period after training with k periods, over that after training with 1."""
    one, long = (np.log(cells[env_id, period, 1][:, 1]) for period in (1, k))
    known = [costs[~np.isnan(costs)] for costs in (one, long)]
    if not all(map(len, known)):
        return np.nan  # no training of a period ever succeeds
    return float(np.exp(known[1].mean() - known[0].mean()))


def results(found):
    """Table of training and test periods, and the claims."""
    cells = cells_of(found)
    ids = [env_id for env_id in IMPULSE + OTHERS if (env_id, 1, 1) in cells]
    metric = {record["job"]["env_id"]: record["found"]["metric"] for record in found}
    lines = []
    for env_id, k in itertools.product(ids, PERIODS):
        tested = [cells[env_id, k, period] for period in PERIODS]
        shown = [f"{100 * pairs[:, 0].mean():.1f} %, {_mean(pairs[:, 1])}" for pairs in tested]
        lines.append((f"`{env_id}`", metric[env_id], str(k), *shown,
                      f"{gain_of(cells, env_id, k):.2f}"))  # fmt: skip
    header = ("environment", "cost", "trained", *(f"tested at {k}" for k in PERIODS), "ratio")
    return "\n\n".join([_TABLE, markdown_table(header, lines, "<<>>>>>"), _verdicts(cells, ids)])


_TABLE = """Success, and mean cost of the successes, by period of training and of test; ratio is the
cost at test period 1 over that of training period 1 (geometric means over the seeds)."""


def _mean(costs):
    return "-" if np.isnan(costs).all() else f"{np.nanmean(costs):.4g}"


def _verdicts(cells, ids):
    cheaper = [e for e in ids if e in IMPULSE and gain_of(cells, e, 4) <= 0.9]
    same = [e for e in ids if e in OTHERS and abs(gain_of(cells, e, 4) - 1.0) <= 0.05]
    safe = [e for e in ids if cells[e, 4, 1][:, 0].mean() >= cells[e, 1, 1][:, 0].mean() - 0.05]
    n_impulse, n_others = (sum(e in kind for e in ids) for kind in (IMPULSE, OTHERS))
    return "\n".join([
        f"- Claim 1. Ratio of 4 periods at most 0.9: {len(cheaper)} of {n_impulse} impulses.",
        f"- Claim 2. Ratio of 4 periods within 5 % of 1: {len(same)} of {n_others} others.",
        f"- Claim 3. Success with 4 periods no 5 points lower: {len(safe)} of {len(ids)}.",
    ])  # fmt: skip


def draw(found):
    """Cost at the short period over that of training with it, against the period of training."""
    cells = cells_of(found)
    figure = new_figure(6.0, 3.6, 110)
    axes = figure.subplots()
    for number, env_id in enumerate(dict.fromkeys(at[0] for at in cells)):
        colour, marker = look(number)
        ratios = [gain_of(cells, env_id, k) for k in PERIODS]
        axes.plot(PERIODS, ratios, color=colour, marker=marker, label=env_id)
    axes.axhline(1.0, color=INK, lw=0.8)
    axes.set_xticks(PERIODS)
    dress(axes, "cost at period 1, over that of training with 1")
    axes.set_xlabel("control period of the training")
    axes.legend(frameon=False, fontsize=8)
    return figure
