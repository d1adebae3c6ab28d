"""The plot of the leaderboard shows each efficiency, with its interval, at its place."""

import numpy as np
import pytest

from rigid_envs.scores.leaderboard import Row, draw, dress, look
from rigid_envs.scores.result import Estimate

pytest.importorskip("matplotlib")


def row(env_id: str, policy: str, *efficiency: float) -> Row:
    """A row of which the plot shows nothing but the efficiency."""
    means = (np.nan, np.nan, np.nan)
    name, success = f"RigidEnvs/{env_id}-v0", Estimate(1, 1, 1)
    return Row(name, policy, success, Estimate(*efficiency), None, means, None, "", None)


@pytest.fixture
def rows() -> list[Row]:
    """Of three ids."""
    return [
        row("BallPark", "shortest_path", 0.9, 0.8, 0.95),
        row("BallPark", "ppo", 0.7, 0.65, 0.72),
        row("Detumble", "ppo", 0.6, 0.5, 0.65),
        row("Detumble", "riccati", 0.4, 0.3, 0.45),
        row("CoinPark", "zero", 0.0, 0.0, 0.1),
    ]


def test_every_row_has_its_point_and_its_interval_beside_the_name_of_its_id(
    rows: list[Row],
) -> None:
    figure = draw(rows)
    (axes,) = figure.axes
    ids = list(dict.fromkeys(row.env_id for row in rows))
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        env_id.split("/")[-1] for env_id in ids
    ]
    places = dict(zip(ids, axes.get_yticks(), strict=True))
    points = [tuple(point) for line in axes.lines for point in line.get_xydata()]
    ends = [path for lines in axes.collections for path in lines.get_segments()]
    assert len(points) == len(ends) == len(rows)
    assert axes.get_xlabel() == "efficiency"
    for row in rows:
        estimate = row.efficiency
        assert estimate is not None
        near = [(x, y) for x, y in points if abs(y - places[row.env_id]) < 0.3]
        assert any(x == estimate.mean for x, _ in near)
        assert any(
            np.allclose(line[:, 0], [estimate.low, estimate.high])
            and abs(line[0, 1] - places[row.env_id]) < 0.3
            for line in ends
        )
    assert len({y for _, y in points}) == len(points)  # no point hides another
    (axes,) = draw(rows[:2]).axes
    assert sum(line.get_ydata()[0] for line in axes.lines) == 0.0  # on both sides of the name


def test_policies_are_told_from_one_another_and_named_in_the_legend(rows: list[Row]) -> None:
    (axes,) = draw(rows).axes
    legend = axes.get_legend()
    assert legend is not None
    names = [text.get_text() for text in legend.get_texts()]
    assert "reference controller" in names and len(set(names)) == len(names) == len(axes.lines)
    assert {(line.get_color(), line.get_marker()) for line in axes.lines} == {
        look(k) for k in range(len(names))
    }
    low, high = axes.get_xlim()
    assert -0.1 < low < 0.0 and 1.0 < high < 1.1  # whole, and no room is left empty


def test_a_plot_says_what_its_vertical_axis_shows() -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    dress(axes, "success")
    assert axes.get_ylabel() == "success"
