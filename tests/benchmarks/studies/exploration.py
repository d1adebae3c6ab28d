"""Exploration noise and optimal control at an L1 cost: laws under noise, and what is learnt."""

import itertools
import math

import numpy as np
import torch
from scipy.special import erf

from rigid_envs.base.files import markdown_table
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.leaderboard import INK, dress, look, new_figure
from rigid_envs.scores.policies import from_controller, from_predict, reference_controllers
from rigid_envs.scores.starts import TEST_SEED, play, rollout, row_seeds
from rigid_envs.systems.free_body.controllers import saddle
from tests.benchmarks.studies.jobs import train

ID = "RigidEnvs/IntermediateAxis-v0"
BODIES = {  # moments [kg m^2] and rate Omega [rad/s]
    "slow": ((1.0, 1.2, 2.0), 1.0),
    "middle": ((1.0, 2.0, 3.0), 1.0),
    "fast": ((1.0, 2.0, 3.0), 2.0),
}
LAWS = ("minimum_fuel", "transfer", "lqr")
AT_TEST = (0.0, 0.05, 0.1, 0.2, 0.4)
IN_TRAINING = (0.025, 0.05, 0.1, 0.2, 0.4)
GAMMA, PRICE, BONUS = 0.995, 5.0, 1.0
STEPS = {"ppo": 400_000, "sac": 100_000, "student": 80_000}
ROWS = 64  # of a student


def jobs(quick):
    """Laws under noise at test, and trainings under noise of which the tests have none."""
    n, share, seeds, grid = (8, 0.005, 1, 50) if quick else (500, 1.0, 3, 800)
    found = [
        {"kind": law, "body": body, "noise": noise}
        for law, body, noise in itertools.product(LAWS, BODIES, AT_TEST)
    ]
    ways = [("middle", noise) for noise in IN_TRAINING]
    ways += [(body, noise) for body in ("slow", "fast") for noise in (0.1, 0.4)]
    found += [{"kind": "theory", "body": body, "noise": s, "grid": grid} for body, s in ways]
    learners = [("ppo", *way) for way in ways] + [("sac", "middle", 0.0)]
    learners += [("student", "middle", noise) for noise in IN_TRAINING]
    found += [
        {"kind": kind, "body": body, "noise": s, "seed": seed, "steps": int(STEPS[kind] * share)}
        for (kind, body, s), seed in itertools.product(learners, range(1, 1 + seeds))
    ]
    if quick:
        found = [job for job in found if (job["body"], job["noise"]) in _QUICK]
    return [{"name": _name(**job), **job, "n": n} for job in found]


_QUICK = (("middle", 0.0), ("middle", 0.4))


def _name(kind, body, noise, seed=None, **_):
    return f"{kind}_{body}_{noise}" + ("" if seed is None else f"_{seed}")


def work(job):
    """Effort and success from each start, and what theory says of it."""
    if job["kind"] in LAWS:
        return _of_law(job)
    return _theory(job) if job["kind"] == "theory" else _of_learner(job)


# Closed forms.


def growth_of(body):
    """Growth rate lambda [1/s] of the unstable mode, and change |b| of d by an impulse."""
    moments, rate = BODIES[body]
    ratio, growth, _ = saddle(np.array(moments))
    return rate * growth, math.hypot(1.0 / moments[0], ratio / moments[2])


def spread_norm(a):
    """E |(a z1, z2, z3)| of standard normal numbers z, for a > 1."""
    e = math.sqrt(a * a - 1.0)
    return math.sqrt(2.0 / math.pi) * (a + math.asinh(e) / e)


def shifted_norm(m):
    """E |m e + z| of three standard normal numbers z and a unit vector e; m > 0, any shape."""
    gauss = math.sqrt(2.0 / math.pi) * np.exp(-0.5 * m * m)
    return gauss + (m + 1.0 / m) * erf(m / math.sqrt(2.0))


def noise_impulse(body, noise, task, n_steps):
    """Impulse that noise costs in an episode under a law which cancels d in every period."""
    grown = math.exp(growth_of(body)[0] * task.dt)
    return n_steps * task.dt * task.torque * noise * spread_norm(math.sqrt(1.0 + grown**2))


# Laws on the task as it is registered, with noise on their actions.


def _of_law(job):
    moments, rate = BODIES[job["body"]]
    body = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    kwargs = {**body, "spin_rate": rate, "torque": 0.2 * rate**2, "start_spread": 0.25 * rate}
    rows = make_rows(ID, job["n"], {**kwargs, "n_substeps": 4})
    law = from_controller(reference_controllers(ID)[job["kind"]])(rows)
    rng = np.random.default_rng(0)

    def act(seen):
        given = law(seen) + job["noise"] * rng.normal(size=(job["n"], 3))
        return np.clip(given, -1.0, 1.0).astype(np.float32)

    episodes = play(act, rows, row_seeds(TEST_SEED, job["n"], "test"))
    return {
        "effort": episodes.costs.tolist(),
        "success": episodes.successes.tolist(),
        "predicted": noise_impulse(job["body"], job["noise"], rows.task, episodes.limit),
    }


# What is learnt: never to leave 0.3 of e2, at the least impulse, with torque to spare.


def _settings(body):
    moments, rate = BODIES[body]
    return {
        **dict(zip(("I1", "I2", "I3"), moments, strict=True)),
        **{"spin_rate": rate, "torque": rate**2, "start_spread": 0.1 * rate},
        **{"tolerance": 0.3, "hold": 29.0, "n_substeps": 16},
    }


def _of_learner(job):
    settings = _settings(job["body"])
    entries = {
        **{"env_id": ID, "env_kwargs": {**settings, "frame": "reduced"}, "seed": job["seed"]},
        "train_kwargs": {"hold": 0.0, "weight_spin": 0.0, "weight_effort": 0.0},
        **{"cost_price": PRICE, "success_bonus": BONUS, "gamma": GAMMA},
        **{"total_timesteps": job["steps"], "normalize_reward": True},
    }
    if job["kind"] == "ppo":
        often = {"n_envs": 64, "n_steps": 64, "batch_size": 1024, "n_epochs": 5}
        model = train({**entries, **often, "action_std": [job["noise"]] * 2})
    elif job["kind"] == "sac":
        model = train({**entries, "algo": "sac"})
    else:
        model = _taught(entries, job)
    rows = make_rows(ID, job["n"], {**settings, "frame": "reduced"})
    return _spent(from_predict(model)(rows), rows)


def _taught(entries, job):
    """A student of `minimum_fuel`: it acts, with noise, and learns what the law would have done."""
    small = {"n_envs": ROWS, "n_steps": 16, "batch_size": 16 * ROWS, "learning_rate": 1e-12}
    model = train({**entries, **small, "total_timesteps": 1})  # as it is initialised
    rows = make_rows(ID, ROWS, entries["env_kwargs"])
    law = reference_controllers(ID)["minimum_fuel"](task_of(ID, _settings(job["body"])))
    rng = np.random.default_rng(job["seed"])
    optimizer = torch.optim.Adam(model.policy.parameters(), 1e-3)
    seen, _ = rows.reset(seed=row_seeds(job["seed"], ROWS, "train"))
    known = [], []
    for step in range(1, job["steps"] // ROWS + 1):
        known[0].append(seen)
        known[1].append(_in_frame(law(rows), rows))
        own = model.predict(seen, deterministic=True)[0]
        noisy = own + job["noise"] * rng.normal(size=own.shape)
        seen, *_ = rows.step(np.clip(noisy, -1.0, 1.0).astype(np.float32))
        optimizer.param_groups[0]["lr"] = 1e-3 * (1.0 - step * ROWS / (job["steps"] + ROWS))
        if step % 8 == 0:
            _regress(model.policy, optimizer, *map(np.concatenate, known), rng)
    return model


def _in_frame(actions, rows):
    """Actions seen from the half turn about e2 that makes d positive."""
    w1, _, w3 = rows.y[:, 4:7].T
    moments = [getattr(rows.task, name) for name in ("I1", "I2", "I3")]
    side = np.where(w1 - saddle(np.array(moments)).ratio * w3 < 0.0, -1.0, 1.0)
    return actions * np.stack([side, np.ones_like(side), side], axis=-1)


def _regress(policy, optimizer, seen, actions, rng, n_steps=20, size=1024):
    """Gradient steps on the mean square of what the means of actions are off."""
    for _ in range(n_steps):
        drawn = rng.integers(len(seen), size=size)
        means = policy.get_distribution(torch.as_tensor(seen[drawn])).distribution.mean
        wanted = torch.as_tensor(actions[drawn], dtype=torch.float32)
        optimizer.zero_grad()
        ((means - wanted) ** 2).mean().backward()
        optimizer.step()


def _spent(act, rows):
    """From each start: the impulse, that along b, which alone changes d, and success."""
    seeds = row_seeds(TEST_SEED, rows.num_envs, "test")
    moments = np.array([getattr(rows.task, name) for name in ("I1", "I2", "I3")])
    b = np.array([1.0, 0.0, -saddle(moments).ratio]) / moments
    totals = np.zeros((2, rows.num_envs))
    for step in rollout(act, rows, seeds):
        along = rows.task.dt * rows.task.torque * np.abs(step.actions @ b) / np.linalg.norm(b)
        totals += step.running * np.array([step.infos["cost"], along])
        won = step.infos["is_success"]
    return {
        "effort": totals[0].tolist(),
        "along": totals[1].tolist(),
        "success": np.asarray(won, dtype=bool).tolist(),
    }


def _theory(job):
    """The proven bound from each start, and the impulse of what is optimal under the noise."""
    rows = make_rows(ID, job["n"], _settings(job["body"]))
    rows.reset(seed=row_seeds(TEST_SEED, job["n"], "test"))
    (lam, b), task = growth_of(job["body"]), rows.task
    moments, rate = BODIES[job["body"]]
    r = saddle(np.array(moments)).ratio
    d = np.abs(rows.y[:, 4] - r * rows.y[:, 6])
    widest = math.sqrt(1.0 + r * r) * task.tolerance * rate
    duration = task.dt * task.registered_steps()
    late = widest * math.exp(-(1.0 - task.tolerance) * lam * duration)
    edge = 2.0 * task.tolerance * rate / math.sqrt(1.0 + r**-2)  # where s = 0
    best = Smoothed(lam, b, task, job["noise"], edge, job["grid"])
    bound = np.maximum(d - late, 0.0) / b
    return {"bound": bound.tolist(), "predicted": best.impulses(d).tolist()}


class Smoothed:
    """Optimal control of d at an L1 cost when every action is spread by noise.

    ``d+ = g d - B m + B noise z1``, and a step costs ``dt torque E |m e + noise z|``, discounted. A
    |d| beyond the tolerance ends it: from there on the bonus is lost, and the noise is paid. Value
    iteration on a grid of d >= 0, over the places t = g d - B m on it; Gauss-Hermite quadrature.

    Args:
        lam: growth rate lambda [1/s].
        b: |b| [1 / (kg m^2)].
        task: the task.
        noise: standard deviation of the actions.
        edge: largest |d| [rad/s].
        n: number of places.
    """

    def __init__(self, lam, b, task, noise, edge, n):
        """Iterate until the value changes by less than 1e-7."""
        self.growth = math.exp(lam * task.dt)
        self.unit = task.dt * task.torque
        self.pull = b * task.torque * (self.growth - 1.0) / lam
        self.d = edge * np.linspace(0.0, 1.0, n) ** 2  # fine near 0
        z, weights = np.polynomial.hermite_e.hermegauss(21)
        place = np.abs(self.d[:, None] + self.pull * noise * z)
        m = np.clip(self.growth * self.d[:, None] - self.d, 0.0, np.inf) / self.pull
        step = np.where(m <= 1.0, self.unit * noise * shifted_norm(m / noise + 1e-9), np.inf)
        none = self.unit * noise * shifted_norm(1e-9)
        lost = (BONUS / PRICE + none) / (1.0 - GAMMA)
        value, change = np.zeros(n), 1.0
        while change > 1e-7:
            after = np.interp(place, self.d, value, right=lost) @ weights / weights.sum()
            costs = step + GAMMA * after
            change = np.abs(costs.min(axis=1) - value).max()
            value = costs.min(axis=1)
        self.place = self.d[costs.argmin(axis=1)]

    def impulses(self, d, n_steps=300):
        """Impulse [N m s] of an episode without noise from each |d|."""
        spent = np.zeros_like(d)
        for _ in range(n_steps):
            grown = self.growth * d
            d = np.minimum(np.interp(d, self.d, self.place), grown)
            spent += self.unit * (grown - d) / self.pull
        return spent


# What the page says.


def _groups(found):
    """Records by kind, body and noise."""
    groups = {}
    for record in found:
        job = record["job"]
        groups.setdefault((job["kind"], job["body"], job["noise"]), []).append(record["found"])
    return groups


def gap_of(groups, kind, body, noise):
    """How far mean effort, and its part along b, are above the mean bound, over all seeds."""
    bound = np.mean(groups["theory", body, noise or IN_TRAINING[-1]][0]["bound"])
    learnt = groups[kind, body, noise]
    return [float(np.mean([each[name] for each in learnt]) / bound) - 1.0
            for name in ("effort", "along")]  # fmt: skip


def results(found):
    """Tables of laws and learners, and the claims."""
    groups = _groups(found)
    parts = ["### Laws", _OF_LAWS, _laws_table(groups), "### Learners", _OF_LEARNERS,
             _learners_table(groups), "### Claims", _verdicts(groups)]  # fmt: skip
    return "\n\n".join(parts)


_OF_LAWS = """Impulse [N m s] that noise adds to an episode, over the one that is predicted for a
law which cancels d in every period; in brackets the success."""
_OF_LEARNERS = """Without noise at test. The gaps are those of the mean impulse, and of its part
along b, above the mean bound; predicted is that of the optimal policy under the noise of
training. The mean size of an action is over that noise."""


def noise_cost(groups, law, body, noise):
    """What noise adds to the mean effort, and what is predicted."""
    quiet, noisy = groups[law, body, 0.0][0], groups[law, body, noise][0]
    return float(np.mean(noisy["effort"]) - np.mean(quiet["effort"])), noisy["predicted"]


def _laws_table(groups):
    lines = []
    for law, body in itertools.product(LAWS, BODIES):
        noises = [s for s in AT_TEST[1:] if {(law, body, s), (law, body, 0.0)} <= groups.keys()]
        if not noises:
            continue
        cells = {}
        for noise in noises:
            cost, predicted = noise_cost(groups, law, body, noise)
            won = 100.0 * np.mean(groups[law, body, noise][0]["success"])
            cells[noise] = f"{cost / predicted:.3f} ({won:.0f} %)"
        lines.append((f"`{law}`", f"{growth_of(body)[0]:.3f}",
                      *(cells.get(noise, "-") for noise in AT_TEST[1:])))  # fmt: skip
    header = ("law", "growth [1/s]", *(f"noise {noise:g}" for noise in AT_TEST[1:]))
    return markdown_table(header, lines, "<" + ">" * (len(header) - 1))


def _learners_table(groups):
    lines = []
    for kind, body, noise in groups:
        if kind not in ("ppo", "student", "sac"):
            continue
        whole, along = gap_of(groups, kind, body, noise)
        learnt = groups[kind, body, noise]
        theory = groups.get(("theory", body, noise), [None])[0]
        expected = "-" if theory is None or kind != "ppo" else f"{_expected(theory):.2f}"
        size = f"{_size(learnt, body) / noise:.3f}" if noise else "-"
        won = f"{100.0 * np.mean([each['success'] for each in learnt]):.1f} %"
        shown = "learnt" if kind == "sac" else f"{noise:g}"
        lines.append((kind, f"{growth_of(body)[0]:.3f}", shown, str(len(learnt)), won,
                      f"{whole:.2f}", f"{along:.2f}", expected, size))  # fmt: skip
    header = ("learner", "growth [1/s]", "noise", "seeds", "success", "gap", "along", "predicted",
              "size / noise")  # fmt: skip
    return markdown_table(header, sorted(lines), "<" + ">" * 8)


def _expected(theory):
    return np.mean(theory["predicted"]) / np.mean(theory["bound"]) - 1.0


def _size(learnt, body):
    """Mean norm of the actions, over 30 s."""
    return float(np.mean([each["effort"] for each in learnt])) / (30.0 * BODIES[body][1] ** 2)


def _verdicts(groups):
    """Each claim, and what was found; nothing of a claim whose records are not there."""
    lines = []
    ratios = [cost / predicted for body in BODIES for noise in AT_TEST[1:4]
              if ("minimum_fuel", body, noise) in groups
              for cost, predicted in [noise_cost(groups, "minimum_fuel", body, noise)]]  # fmt: skip
    if ratios:
        lines.append(f"- Claim 1. Cost of noise up to 0.2 over the closed form: "
                     f"{min(ratios):.3f} to {max(ratios):.3f}.")  # fmt: skip
    gaps = {
        kind: {s: gap_of(groups, kind, "middle", s)[0]
               for s in IN_TRAINING if (kind, "middle", s) in groups}
        for kind in ("ppo", "student")
    }  # fmt: skip
    for number, (kind, each) in zip((2, 4), gaps.items(), strict=True):
        if len(each) > 1:
            slope = np.polyfit(np.log(list(each)), np.log(list(each.values())), 1)[0]
            lines.append(f"- Claim {number}. Exponent of the gap of {kind}: {slope:.2f}.")
    shares = [gaps["student"][s] / gaps["ppo"][s] for s in gaps["student"] if s in gaps["ppo"]]
    if shares:
        lines.append(f"- Claim 4. Gap of student over that of ppo: at most {max(shares):.2f}.")
    alongs = [gap_of(groups, *at)[1] - _expected(groups["theory", *at[1:]][0])
              for at in groups if at[0] == "ppo"]  # fmt: skip
    if alongs:
        lines.append(f"- Claim 3. Gap of ppo along b less the predicted one: {min(alongs):.2f} to "
                     f"{max(alongs):.2f}.")  # fmt: skip
    return "\n".join(sorted(lines))


def draw(found):
    """Gap of learners against the noise of their training."""
    groups = _groups(found)
    figure = new_figure(6.0, 3.8, 110)
    axes = figure.subplots()
    kinds = dict.fromkeys((kind, body) for kind, body, _ in groups if kind in ("ppo", "student"))
    for number, (kind, body) in enumerate(kinds):
        noises = sorted(s for k, b, s in groups if (k, b) == (kind, body))
        colour, marker = look(number)
        gaps = [gap_of(groups, kind, body, s) for s in noises]
        label = f"{kind}, growth {growth_of(body)[0]:.2f}/s"
        axes.plot(noises, [g[0] for g in gaps], color=colour, marker=marker, label=label)
        axes.plot(noises, [g[1] for g in gaps], ":", color=colour)
    axes.axhline(1.0, color=INK, lw=0.8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(shown := sorted({s for _, _, s in groups if s}), map(str, shown))
    axes.minorticks_off()
    axes.set_xlabel("standard deviation of the actions in training")
    dress(axes, "gap (dotted: its part along b)")
    axes.legend(frameon=False, fontsize=8)
    return figure
