"""Rows of docs/clients.md: the recipes, and the page of what came of them."""

from typing import NamedTuple

from rigid_envs.tools.pages.tables import Table
from rigid_envs.tools.pages.writing import as_markdown


class Row(NamedTuple):
    """A recipe, and what it is a recipe of.

    Attributes:
        recipe: file in `recipes`, without its ending.
        program: name of the program on PyPI.
        what: what of it is run.
        environment: requirements of an environment of its own, a file in `requirements`; None for
            programs that the tests need anyway.
        version: of what is no package; None asks the environment.
    """

    recipe: str
    program: str
    what: str
    environment: str | None = None
    version: str | None = None


ROWS = (
    Row("sb3_by_id", "stable-baselines3", "PPO by id, `evaluate_policy`"),
    Row("sb3_make_vec_env", "stable-baselines3", "PPO on `make_vec_env` with `env_kwargs`"),
    Row("sb3_subproc", "stable-baselines3", "PPO on `SubprocVecEnv`"),
    Row("sb3_her", "stable-baselines3", "SAC with `HerReplayBuffer`"),
    Row("sb3_published", "stable-baselines3", "`evaluate_policy` of published policies"),
    Row("sb3_contrib_crossq", "sb3-contrib", "CrossQ"),
    Row("sb3_contrib_recurrent_ppo", "sb3-contrib", "RecurrentPPO"),
    Row("zoo_train_and_enjoy", "rl-zoo3", "`train` and `enjoy` with `configs/zoo/ppo.yml`", "zoo"),
    Row("zoo_all_ids", "rl-zoo3", "experiments of all ids of `configs/zoo`, set up", "zoo"),
    Row("cleanrl_ppo", "cleanrl", "`ppo.py`, unmodified", "cleanrl", "fe8d8a0 of April 2026"),
    Row("tianshou_ppo", "tianshou", "a PPO experiment of the high-level interface", "tianshou"),
    Row("torchrl_envs", "torchrl", "`GymEnv` of all ids, `GymWrapper` of native rows, PPO on them"),
    Row("rllib_ppo", "ray", "RLlib's PPO: sync, async and native rows", "rllib"),
    Row("skrl_ppo", "skrl", "PPO with its defaults on native rows", "skrl"),
    Row("gymnasium_wrappers", "gymnasium", "every wrapper, over all ids, single and native rows"),
    Row("minari_dataset", "minari", "`DataCollector`, data set, and its episodes again", "minari"),
    Row("optuna_search", "optuna", "a search over trainings of `agents`", "optuna"),
)
"""All of them, in the order of the page."""


_SOURCES = "https://github.com/rigid-envs/rigid-envs/blob/main/tests/clients"
_HEAD = f"""\
<!-- Written by `python -m tests.clients`. -->

# Clients

Third-party programs, each run with settings that its documentation names, on environments that it
opens by their ids. Every row is a script of some thirty lines in
[tests/clients/recipes]({_SOURCES}/recipes), and a test:

```bash
python -m tests.clients             # all of them, and this page
python -m tests.clients sb3_by_id   # one
```

Programs that need other packages than the tests have an environment of their own, which is made
once and kept ([tests/clients/requirements]({_SOURCES}/requirements)). Seconds are those of a
processor, imports included: they say that a recipe is short, not how fast a program is. A script
fails if what it trains does not get better, or if what should be equal is not.
"""


def markdown(data):
    """The page.

    Args:
        data: what `running.run` found, by the name of the recipe.
    """
    head = ("program", "Gymnasium", "what is run", "result", "CPU s")
    table = Table(
        head, [_cells(row, data[row.recipe]) for row in ROWS if row.recipe in data], "<<<<>"
    )
    return f"{_HEAD}\n{as_markdown(table)}\n"


def _cells(row, found):
    return (
        f"[{row.program}]({_SOURCES}/recipes/{row.recipe}.py) {found['version']}",
        found["gymnasium"],
        row.what,
        "; ".join(f"{name} {_number(value)}" for name, value in found["result"].items()),
        f"{found['processor_seconds']:.0f}",
    )


def _number(value):
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"
