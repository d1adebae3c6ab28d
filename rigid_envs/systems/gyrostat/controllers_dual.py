"""Controller of a satellite that turns over while its rotor is spun up: the dual-spin turn."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, Integers, integer, positive, require
from rigid_envs.control.linear import clip_to_box
from rigid_envs.systems.gyrostat.system import Gyrostat

_HELD = 10.0  # weight of the spin momentum in the choice of the end
_ACROSS = 1e-9  # of |L|: the least distance from e1 that is counted
_NEVER = np.iinfo(np.int64).max // 2


@dataclass(frozen=True)
class DualSpinTurn(CheckedFields):
    """Leads a satellite from a spin about any axis to rest, all its momentum in a rotor along e1.

    With ``L = |L| (tanh(s), cos(phi) / cosh(s), sin(phi) / cosh(s))`` in body axes

        s' = -(|L| / 2) (1 / A2 - 1 / A3) sin(2 phi),
        phi' = L1 (cos(phi)^2 / A2 + sin(phi)^2 / A3) - omega1,   A1 omega1 = L1 - l,

    and rest is at infinite s. The latitude s grows fastest at sin(2 phi) = -1. Half the way of the
    rotor is to where phi stays there: with l between ``|L| (1 - A1 / A2)`` and ``|L| (1 - A1 /
    A3)`` it rides on the stable manifold of the saddle that e1 along L is then. Longitude and its
    rate are led there, and held, by

        phi' = -gain e, at most sqrt(2 torque abs(e) / A1),

    with the angle e from there. From this ride on the rotor is spun up at full torque, as soon as
    that leads to rest within the tolerance, by steps of the integrator; meanwhile phi turns faster
    and faster, and s changes little. A run-up, some periods of torque the other way before,
    lets phi pass the best angle twice, and s gains a little more. Of the ends e1 and -e1 along L it
    takes the one with the sign of ``10 l / |L| + s - sin(2 phi)``. Region: any spin, with A1 < A2 <
    A3, from rest of L on -e1 or e1 apart.

    Attributes:
        satellite: with a rotor along e1.
        torque: largest torque of its motor [N m].
        dt: control period [s].
        tolerance: largest rate at rest [rad/s].
        n_substeps: steps of the integrator in a period.
        gain: of the longitude [1/s].
        run_up: number of periods that the longest run-up has.

    Raises:
        ValueError: numbers that are not positive, moments in another order, no rotor.

    Source: the saddle and the separatrices of gyrostats: Hughes, *Spacecraft Attitude Dynamics*,
    chapter 6.
    """

    satellite: Gyrostat
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    tolerance: Annotated[float, positive, "rad/s"]
    n_substeps: Annotated[int, integer, 1] = 8
    gain: Annotated[float, positive, "1/s"] = 0.4
    run_up: Annotated[int, integer, 0] = 3

    def __post_init__(self) -> None:
        """Check numbers and satellite."""
        super().__post_init__()
        A = self.satellite.carrier_moments
        require(bool(A[0] < A[1] < A[2]), A, "satellite.carrier_moments", "A1 < A2 < A3")
        positive(self.satellite.J1, "satellite.J1", "kg m^2")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 1).

        Args:
            y: states, shape (..., 10).
        """
        states = np.asarray(y, dtype=np.float64)
        rows = states.reshape(-1, states.shape[-1])
        sense = self.side(rows)
        action = self._ride(rows, sense)
        near = np.flatnonzero(self._within_reach(rows, sense))
        wait = self._wait(rows[near], sense[near])
        action[near] = np.select([wait == 0, wait > 0], [sense[near], -sense[near]], action[near])
        return action.reshape(*states.shape[:-1], 1)

    def latitude(self, y: Array) -> Array:
        """Isometric latitude s of L about e1, shape (...)."""
        L = self.satellite.L_body(y)
        size = np.maximum(np.linalg.norm(L, axis=-1), 1e-300)
        across = np.maximum(np.hypot(L[..., 1], L[..., 2]), _ACROSS * size)
        return np.asarray(np.copysign(np.log((size + np.abs(L[..., 0])) / across), L[..., 0]))

    def side(self, y: Array) -> Array:
        """1 where L is to be led to e1, -1 where it is to -e1, shape (...)."""
        L = self.satellite.L_body(y)
        size = np.maximum(np.linalg.norm(L, axis=-1), 1e-300)
        stored = self.satellite.spin_momenta(y)[..., 0] / size
        lean = _HELD * stored + self.latitude(y) - np.sin(_twice_longitude(L))
        return np.where(lean < 0.0, -1.0, 1.0)

    def _ride(self, y: Array, sense: Array) -> Array:
        """Actions that lead phi to the angle at which s changes fastest, and hold it there."""
        A1, A2, A3 = self.satellite.carrier_moments
        L, omega1 = self.satellite.L_body(y), self.satellite.omega_body(y)[..., 0]
        twice = _twice_longitude(L)
        off = 0.5 * (np.remainder(twice + (0.5 * sense + 1.0) * np.pi, 2.0 * np.pi) - np.pi)
        fastest = np.sqrt(2.0 * self.torque / A1 * np.abs(off))
        wanted = -np.sign(off) * np.minimum(self.gain * np.abs(off), fastest)
        cosine = np.cos(twice)
        drift = 0.5 * L[..., 0] * ((1.0 + cosine) / A2 + (1.0 - cosine) / A3)
        return clip_to_box(A1 * (omega1 + wanted - drift) / (self.dt * self.torque))

    def _within_reach(self, y: Array, sense: Array) -> npt.NDArray[np.bool_]:
        """Where s may still grow to that of rest, ``cosh(s) = |L| / (A3 tolerance)``.

        At full torque it grows for ``sqrt(pi A1 / torque)`` or so, the largest size of an integral
        of ``exp(2 i phi)`` with phi'' = torque / A1.
        """
        A1, A2, A3 = self.satellite.carrier_moments
        size = np.linalg.norm(self.satellite.L_body(y), axis=-1)
        omega1 = sense * self.satellite.omega_body(y)[..., 0]
        goal = np.arccosh(np.maximum(size / (A3 * self.tolerance), 1.0))
        time = np.sqrt(np.pi * A1 / self.torque) + self.run_up * self.dt
        fastest = 0.5 * size * (1.0 / A2 - 1.0 / A3)
        ahead = omega1 > -self.tolerance
        return np.asarray(ahead & (goal - sense * self.latitude(y) <= fastest * time))

    def _wait(self, y: Array, sense: Array) -> Integers:
        """Periods of run-up before full torque that lead to rest first; -1 where none does."""
        if not len(y):
            return np.zeros(0, dtype=np.int64)
        starts, waits = [y], np.arange(self.run_up + 1)
        for _ in range(self.run_up):
            starts.append(self._turned(starts[-1], -sense))
        times = self._time_to_rest(np.concatenate(starts), np.tile(sense, len(starts)))
        times = times.reshape(len(starts), -1) + waits[:, None]
        return np.where(times.min(axis=0) < _NEVER, times.argmin(axis=0), -1)

    def _turned(self, y: Array, action: Array) -> Array:
        """States after a period of full torque, of the sign of the action."""
        u = np.zeros((len(y), 6))
        u[:, 0] = self.torque * action
        return self.satellite.advance(y, u, self.dt, self.n_substeps)

    def _time_to_rest(self, y: Array, sense: Array) -> Integers:
        """Periods of full torque until rest, shape (N,); as good as infinite where it is missed."""
        periods, going = np.full(len(y), _NEVER), np.arange(len(y))
        k = 0
        while len(going):
            y, k = self._turned(y, sense), k + 1
            omega = self.satellite.omega_body(y)
            rest = np.linalg.norm(omega, axis=-1) <= self.tolerance
            periods[going[rest]] = k
            left = ~rest & (sense * omega[..., 0] > -self.tolerance)
            y, sense, going = y[left], sense[left], going[left]
        return periods


def _twice_longitude(L: Array) -> Array:
    """2 phi of L about e1 [rad], shape (...)."""
    return 2.0 * np.arctan2(L[..., 2], L[..., 1])
