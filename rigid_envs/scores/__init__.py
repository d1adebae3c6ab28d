"""Evaluation of policies: fixed starts, metrics, reference controllers and scores.

A score is linear in a metric: 0 is the random policy, 1 an optimum, a bound or a reference
controller. See `evaluate` and `score_scale`.
"""

from rigid_envs.scores.bootstrap import mean_interval
from rigid_envs.scores.controllers import Controller, ControllerFactory, reference_controllers
from rigid_envs.scores.episodes import ActionFunction, Episodes, SupportsPredict
from rigid_envs.scores.evaluation import (
    Evaluation,
    PolicyFactory,
    constant_zero,
    evaluate,
    from_controller,
    from_predict,
    play_starts,
    uniform,
)
from rigid_envs.scores.metrics import METRICS, Metric, metrics_of
from rigid_envs.scores.random_policy import RandomPolicy
from rigid_envs.scores.scales import Anchors, ScoreScale, anchors, score_scale
from rigid_envs.scores.starts import N_STARTS, evaluation_seeds

__all__ = [
    "METRICS",
    "N_STARTS",
    "ActionFunction",
    "Anchors",
    "Controller",
    "ControllerFactory",
    "Episodes",
    "Evaluation",
    "Metric",
    "PolicyFactory",
    "RandomPolicy",
    "ScoreScale",
    "SupportsPredict",
    "anchors",
    "constant_zero",
    "evaluate",
    "evaluation_seeds",
    "from_controller",
    "from_predict",
    "mean_interval",
    "metrics_of",
    "play_starts",
    "reference_controllers",
    "score_scale",
    "uniform",
]
