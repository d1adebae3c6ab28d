"""Motions of the figures: replays that can be made, and that are what the figure says."""

import numpy as np
import pytest

from rigid_envs.tools.gallery import FIGURES, write_figures
from rigid_envs.tools.motions import MOTIONS, motion_of

pytestmark = pytest.mark.long  # see .ci/run


def test_motions_belong_to_figures():
    assert set(MOTIONS) <= set(FIGURES)
    assert motion_of("potential") is None


@pytest.mark.parametrize("name", MOTIONS)
def test_every_motion_can_be_played(name):
    replay = motion_of(name)
    for episode in replay.episodes:
        assert len(episode) > 10
        assert np.isfinite(episode.y).all()
        assert np.abs(np.diff(episode.y, axis=0)).max() > 1e-3  # it moves


def test_the_flip_flips_and_conserves_energy():
    replay = motion_of("flip")
    (episode,) = replay.episodes
    system = replay.task.system(episode.parameters)
    energy = system.invariants(episode.y)["energy"]
    omega2 = episode.y[:, 5]
    assert omega2.min() < -0.9 < 0.9 < omega2.max()
    assert np.ptp(energy) / energy[0] < 1e-7  # fourth order at steps of 0.1 s


def test_the_frisbee_keeps_its_spin_and_the_cusped_top_stops_at_its_top():
    (frisbee,) = motion_of("cones").episodes
    assert np.ptp(frisbee.y[:, 6]) < 1e-7
    replay = motion_of("nutation")
    system = replay.task.system(replay.episodes[0].parameters)
    tilts = [system.accessors["tilt"](episode.y) for episode in replay.episodes]
    assert all(tilt[0] == pytest.approx(np.radians(35.0)) for tilt in tilts)
    assert all(tilt.min() > tilt[0] - 1e-4 for tilt in tilts[1:])


def test_what_moves_is_written_as_a_page_too(tmp_path):
    write_figures(tmp_path, [FIGURES["shortest"], FIGURES["potential"]])
    assert (tmp_path / "shortest.html").stat().st_size < 1.5e6
    assert not (tmp_path / "potential.html").exists()
