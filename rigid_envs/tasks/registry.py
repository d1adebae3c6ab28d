"""The environments as data: one record per id.

What a table, page, test or score needs beside the task class is read here. Code is named by strings
"module:name", so that this module imports nothing.
"""

import importlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

from rigid_envs.base.checks import ConfigError

COSTS = ("path", "time", "effort", "error", "loss")
"""Metrics that can be the cost of an episode: the less the better, and above 0."""


class ErrorTerm(NamedTuple):
    """A reward term that shows an error: the term is ``1 / (1 + sharpness error)``.

    Attributes:
        term: Name of the reward term.
        sharpness: Factor of the error, in 1 / its unit.
        text: Meaning of the error, with its unit.
    """

    term: str
    sharpness: float
    text: str


@dataclass(frozen=True)
class EnvironmentRecord:
    """What is known of an id beside its task class.

    Attributes:
        id: Gymnasium's id.
        task: Task class, as "module:Class".
        max_episode_steps: Time limit in steps.
        family: Heading under which tables and pages list it.
        goal: Whether it is a goal environment.
        early_end: Settings under which episodes also end before the time limit; empty if they
            never do. Contract tests use them.
        metrics: Names of the metrics that are reported, of `rigid_envs.scores.METRICS`; the first
            one, of `COSTS`, is the cost that the efficiency of a success is computed from.
        error: Reward term that the metric "error" is computed from; None without that metric.
        controllers: Reference controllers by name, the best first, each a function
            "module:name" from the task to a controller.
        limits: Theoretical limits by metric, each the "module:name" of a `TheoreticalLimit`.
        optimum: Search for the numerical optimum of the cost, "module:name" of a function
            `rigid_envs.scores.optima.Search`; empty where there is none.
        proof: Proof of lower bounds of the cost, "module:name" of a function
            `rigid_envs.scores.optima.Proof`; empty where there is none.
        decoder: Function "module:name" from the task to a function that finds the states that
            controllers read in observations (`rigid_envs.scores.references.Decoder`); empty if
            there is none.
        predictive: Predictive controller, "module:name"; empty where there is none. It needs the
            extra "control", and so is no reference controller.
        conditions: Conditions of success for planning, "module:name" of a
            `rigid_envs.control.planning.Conditions`; empty where no plans are searched for.
        planner: Planner of the task's own, "module:name" of a function from the task and states
            at starts to plans; empty where there is none.
    """

    id: str
    task: str
    max_episode_steps: int
    family: str
    goal: bool = False
    early_end: Mapping[str, Any] = field(default_factory=dict)
    metrics: tuple[str, ...] = ("time", "success", "return")
    error: ErrorTerm | None = None
    controllers: Mapping[str, str] = field(default_factory=dict)
    limits: Mapping[str, str] = field(default_factory=dict)
    optimum: str = ""
    proof: str = ""
    decoder: str = ""
    predictive: str = ""
    conditions: str = ""
    planner: str = ""


_RECORDS: dict[str, EnvironmentRecord] = {}

ENVIRONMENTS: Mapping[str, EnvironmentRecord] = MappingProxyType(_RECORDS)
"""Every registered id with its record."""


def add(record: EnvironmentRecord) -> None:
    """Add a record; adding an equal one again is harmless.

    Raises:
        ConfigError: a wrong task name or time limit, or an id that has another record.
    """
    place = record.id
    limit: Any = record.max_episode_steps
    if ENVIRONMENTS.get(place, record) != record:
        raise ConfigError(f"env_id = {place!r}; expected an id that is not registered yet")
    if record.task.count(":") != 1:
        raise ConfigError(f"{place}: task = {record.task!r}; expected 'module:Class'")
    if isinstance(limit, bool) or not isinstance(limit, int) or limit < 1:
        raise ConfigError(f"{place}: max_episode_steps = {limit!r}; expected an integer from 1")
    if not record.metrics or record.metrics[0] not in COSTS:
        raise ConfigError(f"{place}: metrics = {record.metrics}; expected one of {COSTS} first")
    if "error" in record.metrics and record.error is None:
        raise ConfigError(f"{place}: error = None; expected an ErrorTerm for the metric 'error'")
    _RECORDS[record.id] = record


def load(name: str) -> Any:
    """The object that is named "module:name".

    Raises:
        ConfigError: the module has no such name.
    """
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except AttributeError:
        raise ConfigError(f"name = {name!r}; expected 'module:name' of what exists") from None


_FAMILIES = {
    **dict.fromkeys(("free_body", "thrown_body"), "Free body"),
    **dict.fromkeys(("gyrostat", "satellite"), "Satellite"),
    **dict.fromkeys(("heavy_top", "spheroid"), "Top"),
    **dict.fromkeys(("rolling_ball", "dynamic_ball"), "Ball"),
    **dict.fromkeys(("roller", "upright_coin", "rolling_disk"), "Coin and wheel"),
}
_SPIN = ErrorTerm("spin", 10.0, "distance from the commanded spin in target rates")
_TILT = ErrorTerm("upright", 10.0, "tilt [rad]")
_LAXER_POSE = {"position_tolerance": 1.5, "angle_tolerance": 1.6}


def _ours(task: str, max_episode_steps: int, metrics: str, **more: Any) -> None:
    """Add an environment of this package.

    Args:
        task: Folder of the system, below `rigid_envs.systems`, a colon, and the name of the task
            class, which is that of the id.
        max_episode_steps: Time limit in steps.
        metrics: Names of the metrics, separated by blanks; the first one is the cost.
        **more: Other entries of the record; code is named relative to the references of the system,
            where the decoder has the name of the task in lower case, unless it is given.
    """
    system, _, name = task.partition(":")
    room = f"rigid_envs.systems.{system}"
    for key in ("controllers", "limits"):
        codes = more.get(key, {})
        more[key] = {label: f"{room}.references:{code}" for label, code in codes.items()}
    more.setdefault("decoder", re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower())
    for key in ("decoder", "predictive", "conditions", "planner", "optimum", "proof"):
        if key in more:
            more[key] = f"{room}.references:{more[key]}"
    more["metrics"] = tuple(metrics.split())
    env_id, place = f"RigidEnvs/{name}-v0", f"{room}.tasks:{name}"
    add(EnvironmentRecord(env_id, place, max_episode_steps, _FAMILIES[system], **more))


def _variant(name: str, original: str, without: str = "") -> None:
    """Add an environment that has another task class than the original, and lacks a controller."""
    record = ENVIRONMENTS[f"RigidEnvs/{original}-v0"]
    room = record.task.partition(":")[0]
    controllers = {key: code for key, code in record.controllers.items() if key != without}
    task = f"{room}:{name}"
    add(replace(record, id=f"RigidEnvs/{name}-v0", task=task, controllers=controllers))


_ours(
    "free_body:IntermediateAxis",
    300,
    "effort success return time error",
    error=_SPIN,
    controllers={
        "transfer": "polhode_transfer",
        "minimum_fuel": "minimum_fuel",
        "lqr": "spin_regulator",
        "energy_casimir": "energy_casimir",
    },
    limits={"effort": "SPIN_EFFORT"},
    predictive="held_spin",
    conditions="SPINNING",
)
_variant("IntermediateAxisRandom", "IntermediateAxis", without="transfer")  # it knows the middle
_ours(
    "free_body:IntermediateAxisSingle",
    300,
    "effort success return time error",
    error=ErrorTerm("axis", 10.0, "angle of the spin from e2 [rad]"),
    controllers={"transfer": "single_transfer", "energy_casimir": "single_torque"},
    limits={"effort": "AXIS_EFFORT"},
    decoder="intermediate_axis",
    conditions="ALIGNED",
)
_ours(
    "free_body:SpinCapture",
    600,
    "effort success return time error",
    error=_SPIN,
    controllers={"transfer": "weak_transfer", "separatrix": "separatrix_steering"},
    limits={"effort": "SPIN_EFFORT"},
    decoder="intermediate_axis",
    conditions="SPINNING",
)
_ours(
    "free_body:AxisFlip",
    250,
    "effort success return",
    controllers={
        "transfer": "timed_transfer",
        "timed": "timed_flip",
        "brute_force": "forced_flip",
    },
    limits={"effort": "SPIN_EFFORT"},
    conditions="FLIPPED",
)
_ours(
    "free_body:Detumble",
    50,
    "loss success return time effort",  # its least is known exactly
    controllers={"riccati": "momentum_regulator", "brake": "momentum_brake"},
    limits={"loss": "DETUMBLE_LOSS", "time": "DETUMBLE_TIME"},
)
_ours(
    "free_body:Reorient",
    100,
    "time success return effort",
    goal=True,
    controllers={"quaternion_pd": "quaternion_pd"},
    limits={"time": "REORIENT_TIME"},
    conditions="TURNED",
)
_ours(
    "heavy_top:SleepingTop",
    300,
    "effort success return time error",
    error=_TILT,
    controllers={"transfer": "sleep_transfer", "lqr": "upright_balance"},
    conditions="UPRIGHT",
)
_ours(
    "rolling_ball:BallPark",
    100,
    "path success return time",
    early_end=_LAXER_POSE,
    controllers={"shortest_path": "along_shortest_path", "three_rolls": "rolled"},
    limits={"path": "BALL_PATH"},
    optimum="least_rolls",
    proof="are_least_rolls",
    conditions="PARKED",
)
_ours(
    "rolling_ball:BallParkGoal",
    100,
    "path success return time",
    goal=True,
    controllers={"shortest_path": "along_shortest_path", "three_rolls": "rolled"},
    limits={"path": "BALL_PATH"},
    optimum="least_rolls",
    proof="are_least_rolls",
    conditions="PARKED",
)
_variant("BallParkRandom", "BallPark")
_variant("BallReorient", "BallPark")
_ours(
    "dynamic_ball:BallParkDynamic",
    100,
    "time success return effort",
    early_end={**_LAXER_POSE, "speed_tolerance": 5.0},
    controllers={"three_rolls": "pushed"},
    limits={"time": "PUSHED_BALL_TIME"},
    conditions="STOPPED",
)
_ours(
    "rolling_ball:BallSteer",
    300,
    "error success return path",
    error=ErrorTerm("close", 5.0, "pose error [radii and rad]"),
    controllers={"lqr": "far_sighted", "damping": "damped"},
    limits={"error": "BALL_STEER_ERROR"},
    conditions="BESIDE",
)
_ours(
    "dynamic_ball:BallPlate",
    200,
    "time success return effort error",
    early_end={"margin": 0.1, "start_speed": 5.0, "n_substeps": 4},
    error=ErrorTerm("near", 5.0, "distance from the point [m]"),
    controllers={"lqr": "plate_regulator"},
    predictive="held_ball",
    conditions="HELD",
    planner="held_soon",
)
_ours(
    "rolling_ball:BallGrid",
    30,
    "path success return time",
    early_end={"start_cells": 0},
    controllers={"breadth_first": "quarter_rolls"},
    limits={"path": "GRID_PATH", "time": "GRID_TIME"},
)
_ours(
    "roller:RollPump",
    400,
    "time success return",
    early_end={"dt": 1.0, "n_substeps": 20, "start_part": 0.99, "beta_change": 3.0},
    controllers={"bang_bang": "pump"},
    limits={"time": "ROLL_PUMP_TIME"},
    planner="pumped_out",
)
_ours(
    "heavy_top:PivotTop",
    400,
    "effort success return time error",
    early_end={"arena": 0.02},
    error=_TILT,
    controllers={"lqr": "pivot_balance"},
    predictive="balanced_top",
    conditions="BALANCED",
)
_ours(
    "heavy_top:TopPrecession",
    400,
    "effort success return time error",
    error=ErrorTerm("tilt", 10.0, "tilt off the commanded one [rad]"),
    controllers={"lqr": "precession_regulator"},
    conditions="PRECESSING",
)
_ours(
    "heavy_top:TopRandom",
    300,
    "effort success return time error",
    error=_TILT,
    controllers={"lqr": "asymmetric_balance"},
    conditions="UPRIGHT_IN_BODY",
)
_variant("SleepingTopRandom", "SleepingTop", without="transfer")
_ours(
    "upright_coin:CoinPark",
    100,
    "path success return time",
    early_end={"position_tolerance": 1.5, "heading_tolerance": 1.5, "phase_tolerance": 1.5},
    controllers={"two_rolls": "two_rolls"},
    limits={"path": "COIN_PATH"},
    conditions="PARKED",
)
_ours(
    "rolling_disk:DiskRoll",
    400,
    "error success return time effort",
    early_end={"start_lean": 1.0},
    error=ErrorTerm("circle", 10.0, "relative error of the curvature"),
    controllers={"lqr": "circle_regulator"},
    conditions="ON_CIRCLE",
)
_variant("DiskRollRandom", "DiskRoll")
_ours(
    "spheroid:TippeTop",
    150,
    "effort success return time",
    controllers={"two_spins": "two_spins", "spin_up": "spin_up"},
    conditions="INVERTED",
)
_ours(
    "thrown_body:RacketCatch",
    75,
    "effort success return",
    early_end={"flight_time": (0.05, 0.15), "turns": 0.05},
    controllers={"shot": "shot", "dead_centre": "dead_centre"},
    conditions="CAUGHT",
)
_ours(
    "gyrostat:WheelReorient",
    100,
    "time success return effort",
    goal=True,
    controllers={"eigenaxis": "eigenaxis"},
    conditions="TURNED",
)
_ours(
    "gyrostat:TwoWheels",
    200,
    "time success return effort",
    goal=True,
    controllers={"three_turns": "three_turns"},
    conditions="TURNED",
)
_ours(
    "gyrostat:WheelTrack",
    300,
    "error success return effort",
    error=ErrorTerm("close", 20.0, "pointing error [rad]"),
    controllers={"look_ahead": "look_ahead", "feedforward": "feedforward", "pd": "pd"},
    conditions="ON_TARGET",
)
_ours(
    "gyrostat:DualSpin",
    200,
    "time success return effort",
    early_end={"rate_tolerance": 0.5},
    controllers={"ride": "ride"},
    limits={"time": "DUAL_SPIN_TIME"},
    conditions="AT_REST",
)
_ours(
    "satellite:MagneticDetumble",
    1000,
    "time success return",
    early_end={"start_rate": (0.0101, 0.011)},
    controllers={"b_dot": "b_dot"},
    limits={"time": "DETUMBLE_TIME"},
    conditions="AT_REST",
)
