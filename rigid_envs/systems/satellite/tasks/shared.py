"""What tasks of a satellite with magnetic coils share: its orbit, its field, its dipole."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine.algebra import Vector, attitude, rotate_inverse
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import sincos
from rigid_envs.systems.free_body.tasks.shared import BodyTask, fastest
from rigid_envs.systems.satellite.dynamics import Input, State
from rigid_envs.systems.satellite.system import Satellite
from rigid_envs.tasks.fields import Entry, Range, physical, span


class Dipole(NamedTuple):
    """Magnetic dipole in body axes, as a fraction of the maximum."""

    m1: float
    m2: float
    m3: float


@scalar
def actuate(a: Dipole, y: State, aux: Any, p: Any, c: Any) -> tuple[State, Input]:
    """Dipole of the coils."""
    return y, Input(c.dipole * a.m1, c.dipole * a.m2, c.dipole * a.m3)


@scalar
def turn_of_field(y: Any) -> tuple[Vector, float, float]:
    """Unit vector h with B' = -3 n b sin(i) h in space, in body axes; cos 2u and sin 2u."""
    s, c = sincos(2.0 * y.latitude)
    return rotate_inverse(attitude(y), (c, s, 0.0)), c, s


@dataclass(frozen=True)
class CoilTask(BodyTask):
    """A task of a satellite on a circular orbit that is turned by magnetic coils."""

    dt: float = setting(4.0, Number("control period", "s", 1e-4, 100.0))
    rotation: str = "none"
    I1: Range = physical(0.04, "principal moment about e1", "kg m^2")
    I2: Range = physical(0.05, "principal moment about e2", "kg m^2")
    I3: Range = physical(0.06, "principal moment about e3", "kg m^2")
    n: Range = physical(0.0011, "mean motion", "rad/s")
    b: Range = physical(2.4e-5, "field on the magnetic equator", "T")
    inclination: Range = setting(
        1.7, Number("inclination of the orbit", "rad", 0.0, math.pi, drawn=True)
    )
    dipole: float = setting(0.1, Number("largest dipole", "A m^2", 1e-9, 1e6))

    system_type: ClassVar = Satellite

    def actions(self) -> tuple[Entry, ...]:
        """Magnetic dipole, in a ball."""
        m = self.dipole
        return tuple(Entry(f"m{k}", "A m^2", "body, ball", -m, m) for k in "123")

    def turned_at_most(self, rate: float, duration: float) -> float:
        """Bound on the rates of motion and integrator [rad/s] after a time [s] from a rate on.

        As in `rigid_envs.systems.satellite.system.Satellite.rate_bound`, for the worst satellite.
        """
        moments = (self.I1, self.I2, self.I3)
        low = [span(moment)[0] for moment in moments]
        high = max(span(moment)[1] for moment in moments)
        n, torque = span(self.n)[1], 2.0 * span(self.b)[1] * self.dipole
        s = math.sqrt(high * (rate + n) ** 2 + 4.0 * n**2 * (high - min(low)))
        s += torque * duration / math.sqrt(min(low))
        turn = fastest(moments, s) + n * max(1.0, high / low[1])
        return max(turn, 2.0 * n, math.sqrt(3.0 * n**2 + torque / min(low)))
