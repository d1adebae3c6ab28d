"""Physical systems: equations of motion, exact invariants, linearisation and simulation.

Each system is a frozen dataclass of physical parameters. All of them share the interface of
`System`; the names of what can be read off a state are in `system.accessors`.
"""

from rigid_envs.systems.base import System
from rigid_envs.systems.contact import RollingContact
from rigid_envs.systems.dynamic_ball import DynamicBall
from rigid_envs.systems.events import Event, crossing, flat, lift_off, slip
from rigid_envs.systems.free_body import FreeBody
from rigid_envs.systems.heavy_top import HeavyTop
from rigid_envs.systems.roller import Roller
from rigid_envs.systems.rolling_ball import RollingBall
from rigid_envs.systems.rolling_disk import RollingDisk
from rigid_envs.systems.stability import lyapunov_exponents, poincare_section
from rigid_envs.systems.trajectory import Trajectory
from rigid_envs.systems.upright_coin import UprightCoin

__all__ = [
    "DynamicBall",
    "Event",
    "FreeBody",
    "HeavyTop",
    "Roller",
    "RollingBall",
    "RollingContact",
    "RollingDisk",
    "System",
    "Trajectory",
    "UprightCoin",
    "crossing",
    "flat",
    "lift_off",
    "lyapunov_exponents",
    "poincare_section",
    "slip",
]
