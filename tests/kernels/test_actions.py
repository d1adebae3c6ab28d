"""Actions outside their space are brought back into it, those inside are left bit for bit."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.engine.episode import clip_to_box, clip_to_disk

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
INSIDE = st.floats(-1.0, 1.0, width=32)


def bits(action):
    return np.array(action, dtype=np.float32).tobytes()


@given(st.tuples(FLOATS, FLOATS, FLOATS))
def test_a_box_action_is_clipped_entry_by_entry(action):
    found, clipped = clip_to_box(action)
    np.testing.assert_array_equal(found, np.clip(action, -1.0, 1.0))
    assert clipped == any(abs(x) > 1.0 for x in action)


@given(st.tuples(INSIDE, INSIDE, INSIDE))
def test_a_box_action_inside_is_left_bit_for_bit(action):
    found, clipped = clip_to_box(action)
    assert bits(found) == bits(action)
    assert not clipped


@given(st.tuples(FLOATS, FLOATS).filter(lambda a: math.hypot(*a) < 1e18))
def test_a_disc_action_keeps_its_direction_and_gets_at_most_length_one(action):
    found, clipped = clip_to_disk(action)
    length = math.hypot(*action)
    # A float32 has 24 bits: the direction turns by at most 2^-24 or so, the length too.
    if clipped:
        assert length > 1.0
        np.testing.assert_allclose(found, np.divide(action, length), rtol=2.0**-23, atol=1e-40)
    else:
        assert length < 1.0 + 2.0**-22
        assert bits(found) == bits(action)


@given(st.tuples(FLOATS, FLOATS).filter(lambda a: math.hypot(*a) < 1e18))
def test_clipping_a_disc_action_twice_changes_nothing(action):
    once, _ = clip_to_disk(action)
    twice, clipped = clip_to_disk(once)
    assert bits(twice) == bits(once)
    assert not clipped


@pytest.mark.parametrize("clip", [clip_to_box, clip_to_disk])
def test_signed_zeros_and_denormals_are_kept(clip):
    tiny = float(np.float32(1e-45))
    action = (-0.0, tiny, 0.0) if clip is clip_to_box else (-0.0, tiny)
    assert bits(clip(action)[0]) == bits(action)
