"""What the pages of the free body and of the top promise alike."""

import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from rigid_envs.base.checks import Array
from rigid_envs.testing.environments import FULL
from tests.from_pages import bodies, tops
from tests.from_pages.model import PAGES, Page
from tests.from_pages.side_by_side import Pair, drawn, environment

KINDS = bodies.KINDS + tops.KINDS
each = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


def cases() -> Iterator[Any]:
    """Pages and arguments; delays and reduced frames, which are other kernels, of few."""
    for kind in KINDS:
        ranges = {"I1": (0.9, 1.1), "I2": (1.5, 1.7), "I3": (2.1, 2.3)}
        others = {"rotation": "matrix", "I1": 1.3, "I2": 1.8}
        if kind in tops.KINDS:
            ranges = {"I3": (0.45, 0.6), "g": (9.0, 10.0)}
            others = {"rotation": "none", "m": 1.1, "I3": 0.52}
        first = f"RigidEnvs/{kind.__name__}-v0" in FULL
        for arguments, is_long in (
            ({"rotation": "rot6d", "dt": 0.04}, False),
            ({"rotation": "quat"}, False),
            ({"rotation": "euler", "observe_params": True, **ranges}, False),
            (others, False),
            ({"frame": "reduced", "observe_params": True, **ranges}, not first),
            ({"rotation": "quat", "action_delay": 3}, not first),
            ({"frame": "reduced", "action_delay": 1, "rotation": "quat"}, True),
        ):
            yield pytest.param(kind, arguments, marks=[pytest.mark.long] * is_long)


@pytest.mark.parametrize(("kind", "arguments"), list(cases()))
def test_arguments_do_the_same(kind: type[Page], arguments: dict[str, Any]) -> None:
    rng, pair = np.random.default_rng(3), Pair(kind, **arguments)
    for _ in range(2):
        pair.reset(rng)
        pair.shake(rng, 15)


@each
def test_default_substeps_do_nearly_the_same(kind: type[Page]) -> None:
    rng, page = np.random.default_rng(2), kind()
    rate = 6.0 if kind in tops.KINDS else 4.0
    # Fourth order: (rate times step)^4 per radian that it turns, at the largest rate [rad/s].
    step = rate * page.dt / page.n_substeps
    pair = Pair(kind, within=step**4 * rate * 30 * page.dt, n_substeps=page.n_substeps)
    pair.reset(rng)
    pair.shake(rng, 30)


@each
def test_episodes_end_when_the_page_says(kind: type[Page]) -> None:
    (n,) = re.findall(r"After (\d+) steps", (PAGES / f"{kind.__name__}.md").read_text())
    env = environment(kind.__name__)
    upright = {"state": {"q": [1, 0, 0, 0], "omega_body": [0, 0, 6]}}
    env.reset(seed=5, options=upright if kind in tops.KINDS else None)
    ends = [env.step(np.zeros(kind.controls, np.float32))[2:4] for _ in range(int(n))]
    assert not any(any(end) for end in ends[:-1])
    assert ends[-1] == (False, True)


@each
def test_random_actions_do_the_same(kind: type[Page]) -> None:
    rng, pair = np.random.default_rng(0), Pair(kind)
    pair.reset(rng)
    clipped = [outcome.info["action_clipped"] for outcome in pair.shake(rng, 40)]
    assert any(clipped) and not all(clipped)


@each
def test_defaults_are_those_of_the_page(kind: type[Page]) -> None:
    name, ours = kind.__name__, kind.defaults()
    envs: list[Any] = [environment(name), environment(name, **ours)]
    for env in envs:
        env.reset(seed=21)
    for _ in range(10):
        action = np.full(kind.controls, 0.5, np.float32)
        rewards = [env.step(action)[1] for env in envs]
        assert rewards[0] == rewards[1]
        assert np.array_equal(*(env.unwrapped.y for env in envs))  # to the bit


@pytest.mark.long
@each
@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_longer_episodes_do_the_same(kind: type[Page], frame: str) -> None:
    pair = Pair(kind, frame=frame)
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        pair.reset(rng)
        pair.shake(rng, 100)


# -- starts


@cache
def theirs(kind: type[Page]) -> tuple[Array, Array, Array]:
    """States, parameters and what is kept beside them, of starts of the environment."""
    y, _, envs = drawn(kind, seed=11)
    state = envs.unwrapped.get_state()
    held = list(envs.unwrapped.task.ranges())  # the parameters of the system, then others
    columns = [held.index({"I_perp": "I1"}.get(name, name)) for name in kind.physical]
    return y, state["parameters"][:, columns], state.get("aux", np.empty((len(y), 0)))


def off_the_spin(page: Page, y: Array, aux: Array) -> Array:
    away = np.linalg.norm(y[:, 4:7] - [0, page.spin_rate, 0], axis=1)
    return np.asarray(away / page.start_spread) ** 3


def tilt(page: Page, y: Array, aux: Array) -> Array:
    low = 1 / 3 if isinstance(page, tops.PivotTop) else 0.0
    tilted = np.arccos(1 - 2 * (y[:, 1] ** 2 + y[:, 2] ** 2)) / page.start_tilt
    return np.asarray((tilted - low) / (1 - low))


def spin(page: Page, y: Array, aux: Array) -> Array:
    """In critical spins."""
    if isinstance(page, tops.PivotTop):
        low, high = 0.3 * page.start_spin, page.start_spin
    elif isinstance(page, tops.TopPrecession):
        low, high = page.start_spin, page.start_spin + page.start_spread
    else:
        low, high = page.start_spin_low, page.start_spin_high
    return np.asarray((y[:, 6] / page.critical() - low) / (high - low))


def rate_across(page: Page, y: Array, aux: Array) -> Array:
    return np.asarray(np.hypot(y[:, 4], y[:, 5]) / page.start_rate) ** 2


def between(values: Array, low: float, high: float) -> Array:
    return np.asarray((values - low) / (high - low))


Share = Callable[[Any, Array, Array], Array]
SHARES: list[tuple[type[Page], Share]] = [
    *((kind, off_the_spin) for kind in (*bodies.KINDS[:3:2], bodies.AxisFlip)),
    (bodies.SpinCapture, lambda p, y, _: between(np.linalg.norm(y[:, 4:7], axis=1), *p.start_rate)),
    (
        bodies.Detumble,
        lambda p, y, _: (np.linalg.norm(p.moments * y[:, 4:7], axis=1) / p.start_momentum) ** 3,
    ),
    (bodies.AxisFlip, lambda p, _, aux: between(aux[:, 0], *p.flip_time)),
    *((kind, tilt) for kind in tops.KINDS),
    *((kind, spin) for kind in tops.KINDS if kind is not tops.TopRandom),
    *((kind, rate_across) for kind in (tops.TopPrecession, tops.TopRandom)),
    (tops.TopRandom, lambda p, y, _: between(y[:, 6], -p.start_spin, p.start_spin)),
    (
        tops.TopPrecession,
        lambda p, _, aux: between(aux[:, 1], p.goal_tilt, p.goal_tilt + p.goal_spread),
    ),
]


@pytest.mark.parametrize(("kind", "share"), SHARES)
def test_starts_fill_the_ranges_of_the_page_evenly(kind: type[Page], share: Share) -> None:
    (y, parameters, aux), page = theirs(kind), kind()
    if kind in tops.KINDS:
        page.parameters = dict(zip(kind.physical, parameters.T, strict=True))
    found = share(page, y, aux)
    slack = 1e-6 if share is tilt else 1e-12  # arccos doubles rounding near 1
    assert -slack <= found.min() and found.max() <= 1.0 + slack
    assert kstest(found, "uniform").pvalue > 1e-4
