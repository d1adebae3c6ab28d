"""Tops that are kept up, led into steady precession, or known to fall."""

import numpy as np
import pytest

from rigid_envs.systems.heavy_top.references import (
    asymmetric_balance,
    pivot_balance,
    precession_regulator,
    upright_balance,
)
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTopRandom
from tests.systems.runs import bound, run

UPRIGHT = {
    "SleepingTop": upright_balance,
    "SleepingTopRandom": upright_balance,
    "PivotTop": pivot_balance,
    "TopRandom": asymmetric_balance,
}


@pytest.mark.parametrize("name", UPRIGHT)
def test_tops_are_kept_upright_by_linear_feedback_from_every_start(name):
    assert run(name, bound(UPRIGHT[name])).success.all()


@pytest.mark.parametrize("branch", ["slow", "fast"])
def test_linear_feedback_leads_into_steady_precession_from_every_start(branch):
    found = run("TopPrecession", bound(precession_regulator), branch=branch)
    assert found.success.mean() >= 0.99


def test_every_drawn_top_can_be_caught_by_the_torque_there_is():
    """A start is caught if ``m g ell theta sqrt(1 - share^2) < torque`` (see the task)."""
    task = SleepingTopRandom()
    heaviest = task.m[1] * task.g * task.ell[1]
    worst = heaviest * task.start_tilt * np.sqrt(1.0 - task.start_spin_low**2)
    assert worst < 0.85 * task.torque
