"""Evaluation of policies: fixed starts, success, cost, efficiency and reference controllers.

The efficiency of an episode is ``s b / max(b, c)``: 0 for a failure, and for a success the best
known cost b from its start over its own cost c. See `evaluate`.
"""

from rigid_envs.scores.best import Best, best_known
from rigid_envs.scores.comparison import Comparison, Pair, compare
from rigid_envs.scores.evaluation import Repeat, evaluate, repeat
from rigid_envs.scores.policies import (
    PolicyFactory,
    constant_zero,
    from_controller,
    from_function,
    from_predict,
    recorded,
    reference_controllers,
    uniform,
)
from rigid_envs.scores.records import read_evaluation
from rigid_envs.scores.result import Estimate, Evaluation
from rigid_envs.scores.starts import METRICS, Cost, metrics_of
from rigid_envs.scores.statistics import (
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
    stratified_bootstrap,
)

__all__ = [
    "METRICS",
    "Best",
    "Comparison",
    "Cost",
    "Estimate",
    "Evaluation",
    "Pair",
    "PolicyFactory",
    "Repeat",
    "best_known",
    "compare",
    "constant_zero",
    "evaluate",
    "from_controller",
    "from_function",
    "from_predict",
    "interquartile_mean",
    "metrics_of",
    "performance_profile",
    "probability_of_improvement",
    "read_evaluation",
    "recorded",
    "reference_controllers",
    "repeat",
    "stratified_bootstrap",
    "uniform",
]
