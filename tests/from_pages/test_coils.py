"""The page of the satellite with magnetic coils is enough to rebuild it."""

import numpy as np
import pytest

from tests.from_pages import attitudes
from tests.from_pages.coils import MagneticDetumble
from tests.from_pages.side_by_side import Pair, in_frames

each = pytest.mark.parametrize(("kind", "frame"), in_frames(MagneticDetumble))
# In a substep the body turns by less than 0.01 rad and its rate changes by some 1e-5 rad/s: 5e-13
# is measured of states after 60 steps. Beside the field roundings turn d by 1e-16 / 1e-6.
WITHIN = 1e-10


@each
def test_episodes_are_alike(kind, frame):
    rng, pair = np.random.default_rng(1), Pair(kind, WITHIN, frame=frame)
    for _ in range(3):
        pair.reset(rng)
        assert len(pair.shake(rng, 60)) == 60


@each
def test_strong_coils_do_the_same(kind, frame):
    rng, pair = np.random.default_rng(2), Pair(kind, WITHIN, frame=frame, dipole=1.5)
    pair.reset(rng)
    before = np.array(pair.page.omega)
    pair.shake(rng, 40)
    assert np.linalg.norm(pair.page.omega - before) > 0.01


@pytest.mark.parametrize(
    "arguments",
    [
        {"I1": (0.03, 0.05), "inclination": (0.3, 3.0), "observe_params": True},
        {"n": (0.002, 0.02), "b": (1e-5, 1e-4), "observe_params": True, "rotation": "quat"},
        {"inclination": 0.0, "start_rate": 0.3, "action_delay": 2, "rotation": "matrix"},
        {"dt": 1.0, "dipole": 5.0, "rate_tolerance": 1e-3, "weight_rate": 3.0},
        {"I2": (0.04, 0.06), "n": (0.001, 0.01), "frame": "reduced", "observe_params": True},
    ],
)
def test_arguments_do_the_same(arguments):
    rng, pair, clipped = np.random.default_rng(3), Pair(MagneticDetumble, WITHIN, **arguments), []
    for _ in range(2):
        pair.reset(rng)
        clipped += [outcome.info["action_clipped"] for outcome in pair.shake(rng, 20)]
    assert any(clipped) and not all(clipped)


@each
def test_rest_ends_the_episode_alike(kind, frame):
    rng, pair = np.random.default_rng(4), Pair(kind, WITHIN, frame=frame)
    pair.reset(rng, [*attitudes.draw(rng), 0.0, 0.00599, -0.008, 1.0])
    last = pair.run(lambda page, k: np.zeros(3), 1)[0]
    assert last.terminated and last.info["is_success"]


@each
@pytest.mark.parametrize("off", [0.0, 1e-6])
def test_momentum_along_the_field_is_alike(kind, frame, off):
    rng, pair = np.random.default_rng(5), Pair(kind, WITHIN, frame=frame)
    page = pair.page
    for _ in range(3):
        y = np.concatenate([attitudes.draw(rng), np.zeros(3), rng.uniform(0.0, 6.0, 1)])
        L = 100.0 * (page.field(y) + off * page.b * rng.normal(size=3))
        y[4:7] = L / page.moments
        pair.reset(rng, y)
        assert np.linalg.norm(page.omega) > 0.03
        pair.shake(rng, 2)
