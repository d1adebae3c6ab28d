"""Motions of the gallery as replays."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.scores.policies import from_controller, reference_controllers
from rigid_envs.systems.gyrostat.figures import THE_SATELLITE, flat_spin
from rigid_envs.systems.heavy_top import closed_forms as theory
from rigid_envs.systems.heavy_top.figures import TOP, parameters
from rigid_envs.systems.spheroid.figures import THE_TOP
from rigid_envs.watch.films import play_episode
from rigid_envs.watch.replays.replay import PastEpisode, Replay, play_again

_BODY, _TOP = "RigidEnvs/IntermediateAxis-v0", "RigidEnvs/SleepingTop-v0"
_BALL, _TABLE = "RigidEnvs/BallPark-v0", "RigidEnvs/BallParkDynamic-v0"
_COIN, _DISK, _PUMP = "RigidEnvs/CoinPark-v0", "RigidEnvs/DiskRoll-v0", "RigidEnvs/RollPump-v0"
_TIPPE, _RACKET = "RigidEnvs/TippeTop-v0", "RigidEnvs/RacketCatch-v0"
_ROTOR = "RigidEnvs/DualSpin-v0"


def motion_of(name: str) -> Replay | None:
    """The motion of a figure; None if it has none.

    Args:
        name: of the figure.
    """
    make = MOTIONS.get(name)
    return None if make is None else make()


def _played(
    env_id: str,
    states: Mapping[str, Mapping[str, Any]],
    actions: npt.ArrayLike,
    config: Mapping[str, Any] | None = None,
) -> Replay:
    """Episodes from given states, by label, all under the same actions, shape (T, n_action)."""
    env: Any = gym.make(env_id, **(config or {})).unwrapped
    episodes: list[PastEpisode] = []
    for label, state in states.items():
        env.reset(seed=0, options={"state": state})
        episodes.append(play_again(env.task, env.get_state(), actions, label))
    return Replay(env_id, env.task, tuple(episodes))


def _idle(env_id: str, seconds: float) -> Array:
    """Actions that do nothing, for a time."""
    env: Any = gym.make(env_id).unwrapped
    return np.zeros((round(seconds / env.task.dt), *env.action_space.shape))


def _bodies(
    states: Mapping[str, Sequence[float]],
    seconds: float,
    env_id: str = _BODY,
    config: Mapping[str, float] | None = None,
) -> Replay:
    starts = {label: {"q": [1.0, 0.0, 0.0, 0.0], "omega_body": w} for label, w in states.items()}
    return _played(env_id, starts, _idle(env_id, seconds), config)


def _tops(cases: Mapping[str, tuple[float, float, float]], seconds: float) -> Replay:
    """Tops by label, each from its tilt, rate of precession and spin."""
    starts = {}
    for label, (tilt, precession, spin) in cases.items():
        y = TOP.state(tilt=tilt, precession=precession, spin=spin)
        starts[label] = {name: TOP.accessors[name](y) for name in ("q", "omega_body")}
    config = {"I_perp": TOP.I1, "I3": TOP.I3, "m": TOP.m, "g": TOP.g, "ell": TOP.ell}
    return _played(_TOP, starts, _idle(_TOP, seconds), config)


def _nutation() -> Replay:
    tilt, spin = math.radians(35.0), 6.0
    kinds = {"smooth": 0.22, "cusped": 0.0, "looping": -0.45}
    return _tops({label: (tilt, rate, spin) for label, rate in kinds.items()}, 20.0)


def _precession() -> Replay:
    tilt, spin = math.radians(50.0), 6.0
    slow, fast = theory.steady_precession(tilt, spin, **parameters(TOP))
    cases = {"slow": float(slow), "fast": float(fast)}
    return _tops({label: (tilt, rate, spin) for label, rate in cases.items()}, 15.0)


def _sleeping() -> Replay:
    threshold = float(theory.sleeping_threshold(**parameters(TOP)))
    shares = (0.5, 0.9, 1.1)
    return _tops({f"{x:g} threshold": (0.01, 0.0, x * threshold) for x in shares}, 30.0)


def _disk() -> Replay:
    tilt = math.radians(25.0)  # of the disk from upright
    q = [math.cos(0.25 * math.pi + 0.5 * tilt), math.sin(0.25 * math.pi + 0.5 * tilt), 0.0, 0.0]
    state = {"q": q, "omega_body": [0.0, 1.0, 2.6], "contact": [0.0, 0.0]}
    return _played(_DISK, {"let go leaning": state}, _idle(_DISK, 20.0))


def _holonomy() -> Replay:
    n, turns = 60, np.linspace(0.0, 2.0 * math.pi, 61)[:-1]
    actions = np.column_stack([-np.sin(turns), np.cos(turns)])
    state = {"q": [1.0, 0.0, 0.0, 0.0], "position": [n * 0.4 / (2.0 * math.pi), 0.0]}
    return _played(_BALL, {"once round a circle": state}, actions)


def _controlled(env_id: str) -> Replay:
    """An episode of each reference controller, from the same start."""
    played = [
        play_episode(from_controller(factory), env_id, 3, label=name)
        for name, factory in reference_controllers(env_id).items()
    ]
    return Replay(env_id, played[0].task, tuple(each.captioned()[1] for each in played))


def _brackets() -> Replay:
    roll, steer = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    loop = np.repeat([steer, roll, -steer, -roll], 3, axis=0)
    state = {"contact": [0.0, 0.0], "steer_rate": 0.0, "roll_rate": 0.0}
    return _played(_COIN, {"four loops": state}, np.tile(loop, (4, 1)))


def _turntable() -> Replay:
    state = {"q": [1.0, 0.0, 0.0, 0.0], "position": [1.5, 0.0], "velocity": [0.0, 1.0], "spin": 0.0}
    config = {"turntable_rate": 2.0 * math.pi / 3.0, "n_substeps": 20}
    return _played(_TABLE, {"no force": state}, _idle(_TABLE, 24.0), config)


def _tippe_top() -> Replay:
    lean, second = 0.1, THE_TOP.standing_jellett
    shares = {"stays upright": 0.3, "stays leaning": 0.7, "turns over": 1.1}
    starts = {}
    for label, share in shares.items():
        spin = share * second / (THE_TOP.I3 * (THE_TOP.radius * math.cos(lean) - THE_TOP.offset))
        y = THE_TOP.state(tilt=lean, spin=spin)
        starts[label] = {name: y[part] for name, part in THE_TOP.components.items()}
    return _played(_TIPPE, starts, _idle(_TIPPE, 30.0))


def _dual_spin() -> Replay:
    """The rotor takes up all of the angular momentum, 1 N m s, in 200 s."""
    body, y = THE_SATELLITE, flat_spin(THE_SATELLITE)
    start = {name: y[part] for name, part in body.components.items()}
    config = {name: getattr(body, name) for name in ("I1", "I2", "I3", "J1")}
    motor = {"torque": 0.005, "capacity": 1.0, "n_substeps": 12}
    return _played(_ROTOR, {"spin-up": start}, np.ones((200, 1)), {**config, **motor})


_ABOUT = {"about e1": (1.0, 0.1, 0.05), "about e2": (0.03, 1.0, 0.03), "about e3": (0.05, 0.1, 1.0)}
_FRISBEE = {"I1": 1.0, "I2": 1.0 + 1e-9, "I3": 2.0, "n_substeps": 2}  # the task asks for I1 < I2
_THROWS = {
    "thrown exactly": (0.0, 2.0 * math.pi, 0.0),
    "twists one way": (0.4, 2.0 * math.pi, 0.0),
    "twists the other way": (-0.4, 2.0 * math.pi, 0.0),
}
MOTIONS: Mapping[str, Callable[[], Replay]] = {
    "polhodes": lambda: _bodies(_ABOUT, 30.0),
    "herpolhode": lambda: _bodies({"a polhode about e1": (0.75, 0.1, 0.56)}, 40.0),
    "cones": lambda: _bodies({"frisbee": (0.2, 0.0, 1.0)}, 30.0, config=_FRISBEE),
    "flip": lambda: _bodies({"near e2": (0.01, 1.0, 0.01)}, 60.0),
    "nutation": _nutation,
    "precession": _precession,
    "sleeping": _sleeping,
    "coin": lambda: _played(_COIN, {"constant rates": {}}, np.tile((1.0, 0.4), (80, 1))),
    "disk": _disk,
    "holonomy": _holonomy,
    "shortest": lambda: _controlled(_BALL),
    "brackets": _brackets,
    "turntable": _turntable,
    "pump": lambda: _controlled(_PUMP),
    "tippe_top": _tippe_top,
    "dual_spin": _dual_spin,
    "twist": lambda: _bodies(_THROWS, 1.0, _RACKET, {"flight_time": 1.0, "twist_chance": 1.0}),
}
"""Figures that move, by name; the others show a static law, or a system without an environment."""
