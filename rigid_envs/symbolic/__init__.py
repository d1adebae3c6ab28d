"""Systems as functions of CasADi, from the functions that are compiled for the environments.

Nothing is written twice: the functions of `rigid_envs.kernels` are run on symbols, with CasADi's
elementary functions in place of our own (`tracing`). CasADi is needed only where a model is made.
"""

from rigid_envs.symbolic.library import casadi
from rigid_envs.symbolic.model import SymbolicModel
from rigid_envs.symbolic.tracing import Tracer

__all__ = ["SymbolicModel", "Tracer", "casadi"]
