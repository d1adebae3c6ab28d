"""Seeds of the rows: independent between runs, and apart for training, selection and test."""

from rigid_envs.scores.starts import TEST_SEED, row_seeds

__all__ = ["TEST_SEED", "VALIDATION_SEED", "row_seeds"]

VALIDATION_SEED = 271828
"""Starts of the evaluations during training, which choose the best policy."""
