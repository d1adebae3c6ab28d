"""What is decoded from observations is the state, up to the rounding of float32."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import States, reference_controllers
from rigid_envs.systems.rolling_ball.controllers import pose_error
from rigid_envs.systems.rolling_disk.controllers import rolling
from rigid_envs.tasks.fields import ROTATIONS
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full

IDS = list(ENVIRONMENTS)
SEEN = [name for name in ROTATIONS if name != "none"]
N, STEPS = 40, 12
ROUNDING = 1e-6
"""Eight roundings of float32 (1.2e-7): of the attitude, and of what is turned by it."""

HIDDEN: dict[str, tuple[str, ...]] = {
    "CoinPark": ("steer_rate", "roll_rate"),
    "BallPlate": ("q",),
    **dict.fromkeys(("IntermediateAxis", "IntermediateAxisRandom", "Detumble", "AxisFlip"), ("q",)),
    **dict.fromkeys(("IntermediateAxisSingle", "SpinCapture"), ("q",)),
}
"""Components of the state that no controller reads, and that are not observed by default."""

KNOWN: dict[str, tuple[str, ...]] = {
    "TopPrecession": ("goal_tilt",),
    "BallPlate": ("point_X", "point_Y"),
    "RollPump": ("beta_change",),
    "DiskRoll": ("goal_curvature",),
    "DiskRollRandom": ("goal_curvature",),
    "AxisFlip": ("time_left",),
    "BallSteer": ("heading_X", "heading_Y", "curvature", "force_X", "force_Y"),
    "BallParkGoal": ("goal_X", "goal_Y"),
}
"""Parts of the auxiliary state that are compared as they are."""


def read(name: str, states: States, shown: bool) -> dict[str, Any]:
    """What controllers read: attitudes as matrices, lengths of balls and coins in radii."""
    system: Any = states.systems[0]
    if name == "BallSteer":  # the pose relative to the reference
        reference = states.auxiliary(*(f"reference_{k}" for k in "wxyzXY"))
        found = {"error": pose_error(system, states.y, reference)}
    elif name.startswith("DiskRoll"):  # place, heading and phase do not count
        found = rolling(states.y)._asdict()
    else:
        hidden = () if shown else HIDDEN.get(name, ())
        hidden += tuple(part for part in HIDDEN.get(name, ()) if part != "q")
        parts = {key: at for key, at in system.components.items() if key not in hidden}
        found = {key: states.y[:, at] for key, at in parts.items()}
    if "q" in found:
        found["q"] = rotations.matrix_from_quaternion(found["q"]).reshape(-1, 9)
    if "Random" in name and hasattr(system, "radius") and "position" in found:
        radii = np.array([each.radius for each in states.systems])[:, None]
        found["position"] = found["position"] / radii
    for key in KNOWN.get(name, ()):
        found[key] = np.maximum(states.auxiliary(key), 0.0 if key == "time_left" else -np.inf)
    if name in ("Reorient", "BallParkGoal"):
        goal = states.auxiliary("goal_w", "goal_x", "goal_y", "goal_z")
        found["goal"] = rotations.matrix_from_quaternion(goal).reshape(-1, 9)
    return found


def compare(env_id: str, **settings: Any) -> None:
    """Random actions in many rows; in every step what is decoded is what is there."""
    name = env_id.split("/")[1].removesuffix("-v0")
    envs: Any = make_rows(env_id, N, settings)
    agent = rigid_envs.reference(env_id, **settings)
    seen, _ = envs.reset(seed=1)
    rng, shown = np.random.default_rng(0), envs.task.rotation != "none"
    for _ in range(STEPS):
        expected = read(name, envs, shown)
        found = read(name, agent.decode(seen), shown)
        assert expected.keys() == found.keys()
        for key, values in expected.items():
            size = 1.0 + np.max(np.abs(values))
            np.testing.assert_allclose(found[key], values, rtol=0, atol=ROUNDING * size)
        choices = envs.task.n_choices
        shape = envs.action_space.shape
        actions = rng.integers(0, choices, shape) if choices else rng.uniform(-1, 1, shape)
        seen, *_ = envs.step(actions.astype(envs.single_action_space.dtype))


@pytest.mark.parametrize("shown", [False, True])
@pytest.mark.parametrize("env_id", IDS)
def test_states_of_the_defaults_are_found_with_observed_parameters_too(
    env_id: str, shown: bool
) -> None:
    compare(env_id, observe_params=shown)


@pytest.mark.parametrize("rotation", SEEN)
@pytest.mark.parametrize("env_id", [each for each in IDS if "RollPump" not in each])
def test_states_are_found_in_any_representation_of_the_attitude(env_id: str, rotation: str) -> None:
    compare(env_id, rotation=rotation, observe_params=True)  # which come after the attitude


@pytest.mark.parametrize("env_id", IDS)
def test_states_are_found_at_other_values_of_all_settings(env_id: str) -> None:
    task = task_of(env_id)
    numbers = {key: value for key, value in asdict(task).items() if type(value) is float}
    if task.n_choices:
        del numbers["dt"]  # which is 1
    compare(env_id, **{key: 0.9 * value for key, value in numbers.items()})


@pytest.mark.parametrize("env_id", IDS)
def test_an_attitude_that_is_needed_and_hidden_is_refused_by_name(env_id: str) -> None:
    needed = {"SleepingTop", "PivotTop", "TopPrecession", "TopRandom", "SleepingTopRandom"}
    needed |= {"BallPark", "BallParkRandom", "BallReorient", "BallParkDynamic", "BallGrid"}
    if env_id.split("/")[1].removesuffix("-v0") in needed | {"CoinPark"}:
        with pytest.raises(ConfigError, match=r"config\.rotation: rotation = 'none'; expected an"):
            rigid_envs.reference(env_id, rotation="none")
    else:
        compare(env_id, rotation="none")


@in_full(IDS)  # noise takes a kernel of its own
def test_noise_is_no_reason_to_stop(env_id: str) -> None:
    envs = make_rows(env_id, 8, {"observation_noise": 0.01})
    agent = rigid_envs.reference(
        env_id, list(reference_controllers(env_id))[-1], observation_noise=0.01
    )
    seen, _ = envs.reset(seed=0)
    state, start = None, np.ones(8, bool)
    for _ in range(110):
        actions, state = agent.predict(seen, state, start)
        seen, _, terminated, truncated, _ = envs.step(actions)
        start = terminated | truncated


def test_a_reference_that_seems_to_rest_has_no_heading() -> None:
    agent = rigid_envs.reference("BallSteer")
    seen = np.zeros(make_rows("RigidEnvs/BallSteer-v0", 1).observation_space.shape)
    np.testing.assert_array_equal(agent.decode(seen).auxiliary("heading_X", "heading_Y"), 0.0)


def test_the_radius_cancels_where_it_is_hidden_and_is_asked_for_where_it_does_not() -> None:
    settings = {"radius": (0.5, 2.0), "start_half_width": 2.0}
    found = rigid_envs.evaluate(
        "BallPark", rigid_envs.reference("BallPark", "three_rolls", **settings), n=20
    )
    assert found.success.mean == 1.0
    with pytest.raises(ConfigError, match=r"config\.radius: radius = \(0\.8, 1\.2\); expected a n"):
        rigid_envs.reference("BallParkGoal", radius=(0.8, 1.2))
