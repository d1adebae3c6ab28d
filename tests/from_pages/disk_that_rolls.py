"""`DiskRoll`: a disk that is to roll on a circle, steered by leaning."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import compose, matrix
from tests.from_pages.rolling import Held, Judged, Model, Settings, in_box, limited, moved
from tests.vectors import cross


@dataclass(frozen=True)
class Disk:
    """Parameters of the system."""

    m: float
    radius: float
    I1: float
    I3: float
    g: float


@dataclass(frozen=True)
class Seen:
    """A state in rolling variables, all in body axes or rad and rad/s."""

    n: Array
    travel: Array
    lean: float
    theta_rate: float
    wn: float
    w3: float
    psi_rate: float
    phi_rate: float


def seen(y: Array) -> Seen:
    """Rolling variables of a state."""
    up, omega = matrix(y[:4])[2], y[4:7]  # the vertical, and the rate, in body axes
    s = math.hypot(up[0], up[1])
    n = np.array([up[0], up[1], 0.0]) / s
    travel = cross([0.0, 0.0, 1.0], n)
    wn, w3 = float(n @ omega), float(omega[2])
    phi_rate = wn / s
    return Seen(
        n=n,
        travel=travel,
        lean=math.atan2(-up[2], s),
        theta_rate=-float(travel @ omega),
        wn=wn,
        w3=w3,
        psi_rate=w3 - phi_rate * up[2],
        phi_rate=phi_rate,
    )


def rate_of_change(y: Array, torque: Array, disk: Disk) -> Array:
    """y', with torques about n, the direction of travel, and the axis.

    Newton's law gives the contact force of ``v = omega x radius n``, Euler's law then omega'.
    """
    R, omega = matrix(y[:4]), y[4:7]
    up, moments, r = R[2], np.array([disk.I1, disk.I1, disk.I3]), disk.radius
    state = seen(y)
    n, across = state.n, math.hypot(up[0], up[1])
    turned = -cross(omega, up)  # the vertical as it moves in body axes
    turned[2] = 0.0
    dn = (turned - n * (n @ turned)) / across + cross(omega, n)  # in space
    force = disk.m * (r * cross(omega, dn) + disk.g * up)
    tau = torque[0] * n + torque[1] * state.travel + torque[2] * np.array([0.0, 0.0, 1.0])
    moment = tau - cross(omega, moments * omega) - r * cross(n, force)
    inertia = np.diag(moments) + disk.m * r * r * (np.eye(3) - np.outer(n, n))
    dq = 0.5 * compose(y[:4], [0.0, *omega])
    contact = r * state.psi_rate * (R @ state.travel)[:2]
    return np.array([*dq, *np.linalg.solve(inertia, moment), *contact])


class DiskRoll(Model):
    """Keep a disk rolling on a circle."""

    clip = staticmethod(in_box)
    SETTINGS: ClassVar[Settings] = {
        "m": 1.0,
        "radius": 1.0,
        "I1": 0.25,
        "I3": 0.5,
        "g": 9.81,
        "torque": 3.0,
        "goal_curvature": 0.1,
        "goal_spread": 0.15,
        "start_lean": 0.1,
        "start_rate": 0.1,
        "start_speed": 0.5,
        "start_spread": 0.45,
        "tolerance": 0.05,
        "hold": 5.0,
        "weight_circle": 0.5,
        "weight_upright": 0.5,
        "weight_effort": 0.1,
        "dt": 0.05,
        "n_substeps": 3,
    }

    @property
    def n_action(self) -> int:
        return 1

    def draw_with(self, rng: np.random.Generator, params: dict[str, float]) -> dict[str, Any]:
        """A start of a wheel with these parameters."""
        p = {k: params.get(k, getattr(self.s, k)) for k in Disk.__dataclass_fields__}
        lean = self.s.start_lean * rng.uniform(-1.0, 1.0)
        wn, wl = self.s.start_rate * rng.uniform(-1.0, 1.0, 2)
        share = self.s.start_speed + self.s.start_spread * rng.uniform()
        rim = p["m"] * p["radius"] ** 2
        pull = p["I1"] * p["m"] * p["g"] * p["radius"]
        w3 = share * math.sqrt(pull / (p["I3"] * (p["I3"] + rim)))
        turns = [(rng.uniform(0.0, 2.0 * math.pi), 3), (0.5 * math.pi + lean, 1)]
        turns.append((rng.uniform(0.0, 2.0 * math.pi), 3))
        q = np.array([1.0, 0.0, 0.0, 0.0])
        for angle, axis in turns:
            turn = np.zeros(4)
            turn[0], turn[axis] = math.cos(0.5 * angle), math.sin(0.5 * angle)
            q = compose(q, turn)
        state = seen(np.array([*q, 0.0, 0.0, 0.0]))
        goal = rng.choice([-1.0, 1.0]) * (
            self.s.goal_curvature + self.s.goal_spread * rng.uniform()
        )
        omega = wn * state.n + wl * state.travel + w3 * np.array([0.0, 0.0, 1.0])
        return {"q": q, "omega_body": omega, "contact": [0.0, 0.0], "goal": goal}

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        return self.draw_with(rng, {})

    def beside(self, aux: Array) -> dict[str, Any]:
        return {"goal": aux[1]}

    def place(self, q: Any, omega_body: Any, contact: Any, goal: float) -> None:
        self.y = np.array([*q, *omega_body, *contact], dtype=float)
        self.goal = float(goal)
        self.disk = Disk(*(getattr(self.p, k) for k in Disk.__dataclass_fields__))
        self.held = Held(self.s.hold, self.s.dt)

    @property
    def q(self) -> Array:
        return self.y[:4]

    def curvature(self) -> float:
        """Curvature of the path of the contact, times the radius."""
        state = seen(self.y)
        psi = state.psi_rate
        return float(limited(state.phi_rate * psi / max(psi * psi, 1e-9), 10.0))

    @property
    def rate(self) -> float:
        across = math.hypot(self.y[4], self.y[5]) / math.cos(seen(self.y).lean)
        return float(abs(self.y[6]) + across + math.sqrt(self.disk.g / self.disk.radius))

    def features(self) -> Array:
        state = seen(self.y)
        rates = limited([state.theta_rate, state.wn, state.w3], 50.0)
        return np.array([state.lean, *rates, self.curvature(), self.goal])

    def move(self, action: Array) -> Judged:
        torque = self.s.torque * float(action[0])
        u = np.array([0.0, torque, 0.0])
        self.y = moved(lambda y: rate_of_change(y, u, self.disk), self.y, self.s.dt)
        lean = seen(self.y).lean
        error = abs(self.curvature() - self.goal) / abs(self.goal)
        fallen = abs(lean) > math.pi / 3.0
        success = self.held.after(error <= self.s.tolerance) and not fallen
        terms = {
            "circle": 1.0 / (1.0 + 10.0 * error),
            "upright": math.cos(lean),
            "effort": -((torque / self.s.torque) ** 2),
        }
        return Judged(terms, self.s.dt * abs(torque), success, fallen)

    def reduced(self) -> Array:
        state, side = seen(self.y), -1.0 if self.goal < 0.0 else 1.0
        both = side * (-1.0 if state.w3 < 0.0 else 1.0)
        lean, wn, w3 = side * state.lean, both * state.wn, abs(state.w3)
        k, goal = side * self.curvature(), abs(self.goal)
        tan, cos = math.tan(lean), math.cos(lean)
        psi = w3 + wn * tan
        dwn, dw3 = 2.0 * w3 + wn * tan, 2.0 / 3.0 * wn  # by the lean, of a uniform disk
        dpsi = dw3 + dwn * tan + wn / cos**2
        dk = (dwn / cos - k * dpsi) / max(psi, 0.1) + k * tan
        missing = float(limited((goal - k) / max(dk, 0.5), 0.5))
        error = (k - goal) / goal
        size = math.log1p(min(abs(error), 20.0) / self.s.tolerance)
        return np.array(
            [
                lean,
                limited(side * state.theta_rate, 50.0),
                limited(wn, 50.0),
                min(w3, 50.0),
                k,
                goal,
                limited(error, 20.0),
                math.copysign(size, error),
                missing,
                limited(missing / 0.03, 1.0),
                lean + missing,
                limited((wn + dwn * missing) * (w3 + dw3 * missing), 20.0),
            ]
        )

    def turn(self, action: Array) -> Array:
        return action if self.goal >= 0.0 else -action


class DiskRollRandom(DiskRoll):
    """With drawn parameters."""

    SETTINGS: ClassVar[Settings] = {
        **DiskRoll.SETTINGS,
        "m": (0.85, 1.15),
        "radius": (0.95, 1.05),
        "I1": (0.3, 0.36),
        "I3": (0.5, 0.6),
        "n_substeps": 4,
    }
