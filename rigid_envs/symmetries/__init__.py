"""Symmetries of the tasks, as maps of states, parameters and actions (NumPy).

They share no formula with the compiled functions of the reduced frames, which are tested with them.
They also serve to multiply recorded data: every transition has as many images as there are
elements.
"""

from rigid_envs.symmetries.symmetry import Point, Symmetry

__all__ = ["Point", "Symmetry"]
