"""Equations of motion of a system: rates, invariants, linearisation; rolling contacts."""

from __future__ import annotations

import abc
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    Array,
    array,
    non_negative,
    number,
    one_named,
    require,
    unit_quaternion,
)
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.mechanics import rotations

if TYPE_CHECKING:
    from rigid_envs.mechanics.symbolic import SymbolicModel


# Accessors of the attitude that all systems with a quaternion share.


def quaternion(y: npt.ArrayLike) -> Array:
    """Attitude q = (w, x, y, z), unit, body to world; shape (..., 4)."""
    return np.array(np.asarray(y, dtype=np.float64)[..., :4])


def matrix(y: npt.ArrayLike) -> Array:
    """Rotation matrix R, v_world = R v_body; shape (..., 3, 3)."""
    return rotations.matrix_from_quaternion(quaternion(y))


def euler(y: npt.ArrayLike) -> Array:
    """Angles (phi, theta, psi) of z-x-z, R = Rz(phi) Rx(theta) Rz(psi) [rad]; shape (..., 3)."""
    return rotations.euler_from_quaternion(quaternion(y))


def gamma(y: npt.ArrayLike) -> Array:
    """R^T e_z, the world vertical in body axes; shape (..., 3)."""
    return rotations.rotate_inverse(quaternion(y), np.array([0.0, 0.0, 1.0]))


ATTITUDE: Mapping[str, Callable[[npt.ArrayLike], Array]] = {
    "q": quaternion,
    "R": matrix,
    "euler": euler,
    "gamma": gamma,
}


# Equations of motion of a physical system: named rows, rates, Jacobians, invariants.

_LARGEST = 1e50  # of a parameter or an entry: products of six stay in double precision


@dataclass(frozen=True)
class Equations(abc.ABC):
    """Equations of motion y' = f(y, u), whose parameters are the fields.

    States and inputs are rows: arrays of shape (..., n) with any leading axes, float64. Frames and
    units of the entries are in `state_entries` and `input_entries`.
    """

    dynamics: ClassVar[Dynamics]
    """Rows and compiled functions: equations of motion, one step, invariants."""
    state_entries: ClassVar[tuple[str, ...]]
    input_entries: ClassVar[tuple[str, ...]]
    components: ClassVar[Mapping[str, slice]]
    """The named parts that a state consists of, and where they stand in y."""
    quantities: ClassVar[tuple[str, ...]] = ()
    """Methods that read what follows from the components off a state: more `accessors`."""

    def __init_subclass__(cls) -> None:
        """Check that the fields are the physical parameters of the dynamics.

        Raises:
            TypeError: other names, or another order.
        """
        super().__init_subclass__()
        if "dynamics" not in cls.__dict__:
            return
        cls.state_entries = cls.dynamics.State._fields
        cls.input_entries = cls.dynamics.Input._fields
        annotated = inspect.get_annotations(cls)
        own = (name for name, kind in annotated.items() if "ClassVar" not in str(kind))
        names = tuple(dict.fromkeys((*cls.parameter_names(), *own)))  # those of the base first
        if names != cls.dynamics.raw_names:
            raise TypeError(
                f"{cls.__name__} has fields {names}; "
                f"expected the arguments of its derive, {cls.dynamics.raw_names}"
            )

    def __post_init__(self) -> None:
        """Refuse parameters whose products and quotients would leave double precision.

        Raises:
            ValueError: one that is no number, or whose size is neither 0 nor from 1e-50 to 1e50.
        """
        expected = f"a size from {1.0 / _LARGEST:g} to {_LARGEST:g}, or 0: choose other units"
        for name in self.parameter_names():
            size = abs(number(getattr(self, name), name))
            require(size == 0.0 or 1.0 / _LARGEST <= size <= _LARGEST, size, name, expected)

    @property
    def conserves(self) -> bool:
        """Whether `invariants` are constant without input: friction takes from them."""
        return True

    @property
    def accessors(self) -> Mapping[str, Callable[[npt.ArrayLike], Array]]:
        """Named quantities of a state: each maps y, shape (..., n_state), to (...) or (..., k).

        The attitude in several forms, the components, and the `quantities` of the system.
        """
        attitude = ATTITUDE if "q" in self.components else {}
        parts = {name: partial(_component, part) for name, part in self.components.items()}
        return {**attitude, **parts, **{name: getattr(self, name) for name in self.quantities}}

    @classmethod
    def state(cls, **components: npt.ArrayLike) -> Array:
        """State row of named components; those left out are at rest.

        Args:
            **components: any of `components`, each of shape (..., k), or (...) where k is 1,
                broadcast together.

        Returns:
            y of shape (..., n_state).

        Raises:
            ValueError: unknown name, wrong last axis, NaN or inf, q not of unit length.
        """
        parts = {}
        for name, value in components.items():
            if name not in cls.components:
                taken = inspect.signature(cls.state).parameters.values()
                more = [each.name for each in taken if each.kind is each.KEYWORD_ONLY]
                one_named(name, [*cls.components, *more], "component")
            entries = cls.state_entries[cls.components[name]]
            n, layout = len(entries), ", ".join(entries)
            rows = array(value, name, *([n] if n > 1 else []), entries=layout)
            parts[name] = rows if n > 1 else rows[..., None]
        lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts.values()))
        y = np.broadcast_to(np.array(cls.dynamics.State()), (*lead, len(cls.state_entries))).copy()
        for name, part in parts.items():
            y[..., cls.components[name]] = part
        if "q" in cls.components:
            unit_quaternion(y[..., :4], "q")
        return y

    @cached_property
    def parameters(self) -> Array:
        """The parameter row p of the kernels: the fields, then what is derived from them."""
        return np.array(self.dynamics.derive(*map(float, astuple(self))), dtype=np.float64)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of the fields."""
        return tuple(field.name for field in fields(cls))

    def rhs(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Time derivative of the state, y' = f(y, u).

        Integrators and finite differences leave the sphere of unit quaternions. There, f is what
        the formulas yield as they stand, with polynomials of q for R(q): an extension of the field
        on the sphere. Its q' is perpendicular to q, so that exact solutions keep the length of q,
        and a drift does not grow by itself. No length but 0 is refused: that of accepted steps
        stays within some percent of 1, but an explicit integrator also tries steps that it rejects
        (`scipy.integrate.solve_ivp` with its defaults: lengths from 0.4 to 2, DOP853: up to 40).

        Args:
            y: state, shape (..., n_state); q may have any length but 0.
            u: input, shape (..., n_input), broadcast against y; zero if left out.

        Returns:
            Array of the shape of y (after broadcasting) [units of y per second].

        Raises:
            ValueError: wrong last axis, NaN or inf, a quaternion that is zero.
        """
        y_rows, u_rows = self._broadcast(self.checked_argument(y), self.checked_input(u))
        return self._evaluate(y_rows, u_rows, np.float64)

    def linearize(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> tuple[Array, Array]:
        """Jacobians A = df/dy and B = df/du of `rhs`, exact to rounding, at any y that `rhs` takes.

        Differentiated by complex step (Squire & Trapp 1998, doi:10.1137/S003614459631241X) through
        the very equations that are simulated. The four quaternion entries count as independent.

        Returns:
            A of shape (..., n_state, n_state) and B of shape (..., n_state, n_input).
        """
        y_rows, u_rows = self._broadcast(self.checked_argument(y), self.checked_input(u))
        tiny = 1e-100
        n, m = y_rows.shape[-1], u_rows.shape[-1]
        seeds = tiny * 1j * np.eye(n + m)
        columns = self._evaluate(
            y_rows[..., None, :] + seeds[:, :n], u_rows[..., None, :] + seeds[:, n:], np.complex128
        )
        jacobian = np.swapaxes(columns.imag / tiny, -1, -2)
        return jacobian[..., :n].copy(), jacobian[..., n:].copy()

    def invariants(self, y: npt.ArrayLike) -> dict[str, Array]:
        """Quantities that are constant without input, each of shape (...)."""
        rows = self.checked_state(y)
        flat = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]))
        names = self.dynamics.Invariants._fields
        out = np.empty((len(flat), len(names)))
        self.dynamics.measure_rows(flat, self.parameters, out)
        return {name: out[:, k].reshape(rows.shape[:-1]) for k, name in enumerate(names)}

    def rate(self, y: npt.ArrayLike) -> Array:
        """Largest rate of the motion and of the turns of a step [rad/s], shape (...).

        Times the step it must stay within the stability envelope. It is 0 where the input alone
        sets the rates.
        """
        return self._rates(self.checked_state(y))

    def symbolic(self, free: Sequence[str] = ()) -> SymbolicModel:
        """The same equations, integrator step and invariants as functions of CasADi.

        They are made by running the functions that are compiled for the environments on symbols.

        Args:
            free: physical parameters that become the entries of an input p, in this order; the
                others have the values of this system.

        Raises:
            MissingPackageError: CasADi is not installed; names the command that installs it.
            ValueError: a name that is no physical parameter.
        """
        from rigid_envs.mechanics.symbolic import SymbolicModel  # an optional package: only here

        return SymbolicModel(self.dynamics, asdict(self), tuple(free))

    @classmethod
    def checked_state(cls, y: npt.ArrayLike) -> Array:
        """The state y as float64 of shape (..., n_state): one that a motion may begin with.

        Raises:
            ValueError: wrong last axis, NaN or more than 1e50, or a quaternion that is not unit.
        """
        rows = cls._finite(y)
        if "q" in cls.components:
            unit_quaternion(rows[..., :4], "q")
        return _moderate(rows, "y")

    @classmethod
    def checked_argument(cls, y: npt.ArrayLike) -> Array:
        """The argument y of `rhs`, shape (..., n_state): a state, or what an integrator tries.

        Raises:
            ValueError: wrong last axis, NaN or more than 1e50, or a quaternion that is zero.
        """
        rows = cls._finite(y)
        if "q" in cls.components:
            q = rows[..., :4]
            expected = "a quaternion that is not zero: (1, 0, 0, 0) is no rotation"
            require(np.any(q != 0.0, axis=-1), q, "q", expected)
        return _moderate(rows, "y")

    @classmethod
    def _finite(cls, y: npt.ArrayLike) -> Array:
        n, layout = len(cls.state_entries), ", ".join(cls.state_entries)
        return array(y, "y", n, entries=layout)

    @classmethod
    def checked_input(cls, u: npt.ArrayLike | None) -> Array:
        """The input u as float64 of shape (..., n_input); zeros for None.

        Raises:
            ValueError: wrong last axis, NaN or more than 1e50.
        """
        n = len(cls.input_entries)
        if u is None:
            return np.zeros(n)
        return _moderate(array(u, "u", n, entries=", ".join(cls.input_entries)), "u")

    @staticmethod
    def _broadcast(y: Array, u: Array) -> tuple[Array, Array]:
        lead = np.broadcast_shapes(y.shape[:-1], u.shape[:-1])
        return (
            np.broadcast_to(y, (*lead, y.shape[-1])),
            np.broadcast_to(u, (*lead, u.shape[-1])),
        )

    def _rates(self, rows: Array) -> Array:
        flat = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]))
        out = np.empty(len(flat))
        self.dynamics.rate_rows(flat, self.parameters, out)
        return out.reshape(rows.shape[:-1])

    def _evaluate(self, y: npt.NDArray[Any], u: npt.NDArray[Any], dtype: type) -> npt.NDArray[Any]:
        y_rows: npt.NDArray[Any] = np.array(y, dtype=dtype, order="C").reshape(-1, y.shape[-1])
        u_rows: npt.NDArray[Any] = np.array(u, dtype=dtype, order="C").reshape(-1, u.shape[-1])
        out = np.empty_like(y_rows)
        self.dynamics.evaluate_rows(y_rows, u_rows, self.parameters.astype(dtype), out)
        return out.reshape(y.shape)


def _moderate(rows: Array, name: str) -> Array:
    """Rows, refused where products of their entries would overflow."""
    require(np.abs(rows) <= _LARGEST, rows, name, f"numbers up to {_LARGEST:g} in size")
    return rows


def _component(part: slice, y: npt.ArrayLike) -> Array:
    """The entries of a component of y, shape (..., k), or (...) where k is 1."""
    rows = np.array(np.asarray(y, dtype=np.float64)[..., part])
    return rows[..., 0] if rows.shape[-1] == 1 else rows


def instead(components: Mapping[str, npt.ArrayLike], name: str, given: Mapping[str, Any]) -> bool:
    """Whether any of some values is given, which say what a component would say.

    Args:
        components: those that are given.
        name: of the component.
        given: the values by name, None where they are left out.

    Raises:
        ValueError: the component is given as well.
    """
    named = [key for key, value in given.items() if value is not None]
    expected = f"none beside {', '.join(named)}: one follows from the other"
    require(not named or name not in components, components.get(name), name, expected)
    return bool(named)


def _columns(given: Mapping[str, npt.ArrayLike | None], rest: Array) -> Array:
    """Rows of values, shape (..., n), with entries of `rest` for those that are left out."""
    columns = [
        rest[..., k] if value is None else array(value, name)
        for k, (name, value) in enumerate(given.items())
    ]
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


class TurningBody(Equations):
    """A body whose state has the component `omega_body`, along its principal axes."""

    @classmethod
    def state(
        cls,
        *,
        tilt: npt.ArrayLike | None = None,
        azimuth: npt.ArrayLike | None = None,
        phase: npt.ArrayLike | None = None,
        precession: npt.ArrayLike | None = None,
        nutation: npt.ArrayLike | None = None,
        spin: npt.ArrayLike | None = None,
        **components: npt.ArrayLike,
    ) -> Array:
        """State row of Euler angles and their rates, or of components; what is left out is at rest.

        ``R = Rz(azimuth) Rx(tilt) Rz(phase)``, and the body turns at `precession` about the
        vertical, at `nutation` about the line of nodes, and about its axis so that the component of
        omega along it is `spin`.

        Args:
            tilt: theta, of the axis e3 from the vertical, from 0 to pi [rad].
            azimuth: phi, of the line of nodes about the vertical [rad].
            phase: psi, of the body about e3 [rad].
            precession: phi' [rad/s].
            nutation: theta' [rad/s].
            spin: omega . e3 = psi' + phi' cos(theta) [rad/s].
            **components: any of `components`; q in place of the angles, omega_body in place of the
                rates. All are of shape (...), or (..., k), and broadcast together.

        Returns:
            y of shape (..., n_state).

        Raises:
            ValueError: unknown name, no finite numbers, a tilt beyond its range, or what says the
                same twice.
        """
        angles = {"azimuth": azimuth, "tilt": tilt, "phase": phase}
        rates = {"precession": precession, "nutation": nutation, "spin": spin}
        placed, turns = instead(components, "q", angles), instead(components, "omega_body", rates)
        if not placed and not turns:
            return super().state(**components)
        at = rotations.euler_from_quaternion(components.get("q", cls.dynamics.State()[:4]))
        if placed:
            at = _columns(angles, at)
            theta, expected = at[..., 1], "an angle from 0 to pi rad: np.radians converts degrees"
            require((theta >= 0.0) & (theta <= np.pi), theta, "tilt", expected)
            components["q"] = rotations.quaternion_from_euler(at)
        if turns:
            at, rows = np.broadcast_arrays(at, _columns(rates, np.zeros(3)))
            psi_rate = rows[..., 2] - rows[..., 0] * np.cos(at[..., 1])
            rows = np.concatenate([rows[..., :2], psi_rate[..., None]], axis=-1)
            components["omega_body"] = rotations.omega_body_from_euler_rates(at, rows)
        return super().state(**components)

    @property
    @abc.abstractmethod
    def moments(self) -> Array:
        """Principal moments [kg m^2], shape (3,)."""

    def tilt(self, y: npt.ArrayLike) -> Array:
        """Angle theta between e3 and the vertical [rad], in [0, pi], shape (...)."""
        vertical = gamma(y)
        return np.asarray(
            np.arctan2(np.hypot(vertical[..., 0], vertical[..., 1]), vertical[..., 2])
        )

    def omega_body(self, y: npt.ArrayLike) -> Array:
        """Angular velocity in body axes [rad/s], shape (..., 3)."""
        return _component(self.components["omega_body"], y)

    def omega_world(self, y: npt.ArrayLike) -> Array:
        """Angular velocity in world axes [rad/s], shape (..., 3)."""
        return rotations.rotate(quaternion(y), self.omega_body(y))

    def L_body(self, y: npt.ArrayLike) -> Array:
        """Angular momentum I omega about the point of the moments, body axes [N m s]."""
        return self.moments * self.omega_body(y)

    def L_world(self, y: npt.ArrayLike) -> Array:
        """Angular momentum about the point of the moments, world axes [N m s], shape (..., 3)."""
        return rotations.rotate(quaternion(y), self.L_body(y))


# What a contact must bear: the normal force, and the friction that rolling needs.


CONTACT = ("contact_force", "normal_force", "needed_friction")
"""Methods of a `RollingContact` among the `quantities` of a system."""


class RollingContact(Equations):
    """A system that rolls as if it were held to its ground; these say where it would not be.

    The motion is that without slip and without lift-off: equations and integrator do not change
    where a contact could not give the force.

    Attributes:
        mu: coefficient of static friction, by which `slips` judges; the motion does not depend on
            it.
    """

    mu: float

    def contact_force(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Force of the ground [N]: friction, and last the normal force, shape (..., n).

        By Newton's law, m a less weight and applied force. It is in axes of the plate for a
        `DynamicBall`; in those of the world for a `RollingDisk` and an `UprightCoin`, whose z is
        the normal of the plane; along the path and normal to it for a `Roller`, n = 2.

        Args:
            y: state, shape (..., n_state).
            u: input, shape (..., n_input), broadcast against y; zero if left out.

        Raises:
            ValueError: as `checked_state` and `checked_input`.
        """
        rows, inputs = self._broadcast(self.checked_state(y), self.checked_input(u))
        y_rows = np.array(rows, order="C").reshape(-1, rows.shape[-1])
        u_rows = np.array(inputs, order="C").reshape(-1, inputs.shape[-1])
        out = np.empty((len(y_rows), self.dynamics.contact.n_force))
        self.dynamics.force_rows(y_rows, u_rows, self.parameters, out)
        return out.reshape(*rows.shape[:-1], -1)

    def normal_force(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Force of the ground along its normal [N], shape (...): below 0 it would lift off."""
        return np.asarray(self.contact_force(y, u)[..., -1])

    def needed_friction(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Least coefficient of friction without slip, shape (...); infinite without contact."""
        force = self.contact_force(y, u)
        friction, normal = np.linalg.norm(force[..., :-1], axis=-1), force[..., -1]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = friction / np.maximum(normal, 0.0)
        return np.asarray(np.where(normal > 0.0, ratio, np.inf))

    def slips(
        self, y: npt.ArrayLike, u: npt.ArrayLike | None = None, *, mu: float | None = None
    ) -> npt.NDArray[np.bool_]:
        """Whether rolling would need more friction than there is, shape (...).

        Args:
            y: state, shape (..., n_state).
            u: input, shape (..., n_input).
            mu: coefficient of friction; that of the system if left out.

        Raises:
            ValueError: mu is negative; see `contact_force` for y and u.
        """
        coefficient = self.mu if mu is None else non_negative(mu, "mu", "1")
        return np.asarray(self.needed_friction(y, u) > coefficient)
