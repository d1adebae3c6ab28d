"""Regions that no input leaves: their polygons, and least times against all sequences of inputs."""

import itertools

import numpy as np

from rigid_envs.control.planning import planar

RNG = np.random.default_rng(0)


def some_polygon(n, rng=RNG):
    """Of random radii, so with many corners that point inwards."""
    angles = np.sort(rng.uniform(-np.pi, np.pi, n))
    radii = rng.uniform(1.0, 2.0, n)[:, None]
    return planar.star(planar.sides(radii * np.stack([np.cos(angles), np.sin(angles)], axis=-1)))


def points_on(segments, n=50):
    t = np.linspace(0.0, 1.0, n)[:, None, None]
    return ((1.0 - t) * segments[:, 0] + t * segments[:, 1]).reshape(-1, 2)


def test_no_segment_enters_a_star_and_some_touch_it_on_every_side():
    polygon = some_polygon(60)
    loose = RNG.uniform(-2.0, 2.0, (40, 1, 2)) + RNG.uniform(-0.3, 0.3, (40, 2, 2))
    loose = loose[(np.linalg.norm(loose, axis=-1) > 0.8).all(axis=1)]
    both = np.concatenate([planar.sides(polygon), loose])
    inner = planar.star(both)
    gauges = planar.gauge(inner, points_on(both))
    assert gauges.min() >= 1.0 - 1e-9
    assert gauges.min() < 1.0 + 1e-6  # thinned by no more than this
    # what is cut off is behind a segment: a little beyond each vertex, or the polygon ends there
    assert (planar.gauge(polygon, inner) <= 1.0 + 1e-9).all()


def test_the_gauge_is_the_factor_by_which_a_polygon_reaches_a_point():
    polygon = some_polygon(30)
    on_sides = points_on(planar.sides(polygon))
    np.testing.assert_allclose(planar.gauge(polygon, on_sides), 1.0, rtol=1e-9)
    np.testing.assert_allclose(planar.gauge(polygon, 0.3 * on_sides), 0.3, rtol=1e-9)


def test_refining_moves_no_side_and_leaves_no_long_one():
    polygon = some_polygon(30)
    fine = planar.refined(polygon, (1.0, 0.5), 0.05)
    steps = np.abs(np.diff(fine, axis=0, append=fine[:1])) @ [1.0, 0.5]
    assert steps.max() <= 0.05 * (1.0 + 1e-12)
    np.testing.assert_allclose(planar.gauge(polygon, fine), 1.0, rtol=1e-9)


def test_boxes_around_points_of_an_eroded_polygon_are_in_the_polygon():
    for seed in range(5):
        polygon = some_polygon(40, np.random.default_rng(seed))
        half = np.broadcast_to([0.02, 0.05], polygon.shape)
        points = points_on(planar.sides(planar.eroded(polygon, half)))
        t = np.linspace(-1.0, 1.0, 21)
        around = np.array([*itertools.product(t, (-1.0, 1.0)), *itertools.product((-1.0, 1.0), t)])
        boxes = points[:, None] + around * [0.02, 0.05]
        assert planar.gauge(polygon, boxes).max() <= 1.0 + 1e-6


# s' = u p, p' = -s, as a child on a swing that changes its length: a linear motion for each input,
# held for a period. To the edge of the strip |s| < 1 from rest.

DT, SLOW, FAST = 0.3, 0.7, 1.3


def swung(x, u, dt):
    """Points x (..., 2) after a time."""
    w = np.sqrt(u)
    c, s = np.cos(w * dt), np.sin(w * dt)
    return np.stack([c * x[..., 0] + w * s * x[..., 1], c * x[..., 1] - s / w * x[..., 0]], axis=-1)


def sheared(x, sign):
    """(s, p) to (s, p + dt / 2 s), and back: there u moves points nearly along s."""
    return x + sign * 0.5 * DT * x[..., :1] * np.array([0.0, 1.0])


def before(x, inputs):
    u = (SLOW + (FAST - SLOW) * inputs)[:, None]
    return sheared(swung(sheared(x, -1.0), u, -DT), 1.0)


def margin(x):
    """The trapezoidal rule's error of a kick; images of chords are chords."""
    size = np.abs(x[:, 0]) + 2.0 * DT * np.abs(x[:, 1])
    return np.stack([np.full(len(x), 1e-9), 1e-9 + 1.2 * (FAST - SLOW) * DT**3 / 12.0 * size], 1)


def regions():
    wall = np.array([[-1.0, -3.0], [1.0, -3.0], [1.0, 3.0], [-1.0, 3.0]])
    return planar.regions(wall, planar.PlanarMotion(before, margin, (1.0, DT * FAST), 0.02))


def test_the_margin_covers_what_an_input_changes_of_the_second_coordinate():
    x, inputs = RNG.uniform(-1.0, 1.0, (500, 2)) * [1.0, 2.0], np.linspace(0.0, 1.0, 9)
    after = sheared(swung(sheared(x, -1.0), (SLOW + (FAST - SLOW) * inputs)[:, None], DT), 1.0)
    assert (np.ptp(after[..., 1], axis=0) < margin(after[0])[:, 1]).all()


def test_nothing_leaves_in_fewer_periods_and_all_inputs_tried_hardly_take_more():
    starts, most = np.linspace(0.6, 0.98, 40), 11
    x = sheared(np.stack([starts, 0.0 * starts], axis=-1), 1.0)
    bound = np.zeros(len(starts), dtype=int)
    for k, region in zip(range(most), regions(), strict=False):
        bound[planar.gauge(region, x) < 1.0] = k + 1
    least, y = np.full(len(starts), most + 1), np.stack([starts, 0.0 * starts], axis=-1)[None]
    for k in range(1, most + 1):  # all sequences of three inputs, one of them between
        y = np.concatenate([swung(y, u, DT) for u in (SLOW, 1.0, FAST)])
        least[(np.abs(y[..., 0]) >= 1.0).any(axis=0) & (least > k)] = k
    assert set(least) == {8, 9, 10, 11, most + 1} and (bound <= least).all()
    assert np.mean(bound == np.minimum(least, most)) > 0.9
