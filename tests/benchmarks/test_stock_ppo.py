"""Trainings of the benchmark are of the same length, and rows of ours change nothing in one."""

from tests.benchmarks.stock_ppo import TRAINERS, measure


def test_curves_on_rows_of_either_kind_are_the_same_and_times_are_positive() -> None:
    single, ours, application = found = measure((0,), 5 * 256 * 64)
    assert [kind.name for kind in found] == list(TRAINERS)
    assert single.returns == ours.returns
    for kind in found:
        assert [len(returns) for returns in kind.returns] == [len(kind.fractions)]
        assert min(kind.seconds) > 0.0 and kind.timesteps == application.timesteps
