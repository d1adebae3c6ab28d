"""Physical systems: equations of motion, exact invariants, linearisation and simulation.

Each system is a frozen dataclass of physical parameters. All of them share the interface of
`System`; the names of what can be read off a state are in `system.accessors`.
"""

import importlib
from importlib.util import find_spec
from pkgutil import iter_modules
from types import ModuleType

from rigid_envs.mechanics.equations import RollingContact
from rigid_envs.mechanics.events import Event, crossing, flat, lift_off, slip
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.mechanics.system import System, lyapunov_exponents, poincare_section
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_disk.system import EulerDisk, RollingDisk
from rigid_envs.systems.satellite.system import Satellite
from rigid_envs.systems.spheroid.system import Spheroid
from rigid_envs.systems.thrown_body.system import ThrownBody
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.tasks.registry import ENVIRONMENTS

__all__ = [
    "DynamicBall",
    "EulerDisk",
    "Event",
    "FreeBody",
    "Gyrostat",
    "HeavyTop",
    "Roller",
    "RollingBall",
    "RollingContact",
    "RollingDisk",
    "Satellite",
    "Spheroid",
    "System",
    "ThrownBody",
    "Trajectory",
    "UprightCoin",
    "crossing",
    "flat",
    "lift_off",
    "lyapunov_exponents",
    "poincare_section",
    "slip",
]


def modules_of_all(name: str) -> list[ModuleType]:
    """The modules of a name in the folders of the systems: those of the registry first, in order.

    Args:
        name: such as "laws"; a system need not have it.
    """
    tasks = (record.task.partition(":")[0] for record in ENVIRONMENTS.values())
    folders = dict.fromkeys(
        task.removesuffix(".tasks") for task in tasks if task.startswith(__name__)
    )
    folders |= dict.fromkeys(f"{__name__}.{each.name}" for each in iter_modules(__path__))
    places = (f"{folder}.{name}" for folder in folders)
    return [importlib.import_module(place) for place in places if find_spec(place)]
