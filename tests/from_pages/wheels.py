"""A coin that parks, a disk that rolls, and a roller that pumps."""

import math
from dataclasses import dataclass

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import compose, matrix
from tests.from_pages.model import Held, Judged, Model, Turning, limited, moved, root, smooth
from tests.vectors import cross


def within_half_a_turn(angle):
    """The same angle from -pi to pi."""
    return math.remainder(angle, 2.0 * math.pi)


def attitude_of(heading, phase):
    """q of R = Rz(heading) Rx(pi / 2) Rz(phase)."""
    half = math.sqrt(0.5)
    first = [math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)]
    last = [math.cos(0.5 * phase), 0.0, 0.0, math.sin(0.5 * phase)]
    return compose(compose(first, [half, half, 0.0, 0.0]), last)


def angles_of(q):
    """Heading and phase of an upright attitude."""
    R = matrix(q)
    return math.atan2(R[0, 2], -R[1, 2]), math.atan2(R[2, 0], R[2, 1])


class CoinPark(Model):
    """Park a coin."""

    def draw(self, rng, params):
        half = self.s.start_half_width
        return {
            "q": attitude_of(*rng.uniform(-math.pi, math.pi, 2)),
            "contact": rng.uniform(-half, half, 2),
        }

    def place(self, q, contact, **_):
        self.heading, self.phase = angles_of(q)
        self.contact = np.array(contact, dtype=float)

    @property
    def q(self):
        return attitude_of(self.heading, self.phase)

    def features(self):
        return np.asarray(limited(self.contact / self.p.radius, 50.0))

    def move(self, action):
        rolled, turned = self.s.roll_per_step * action[0], self.s.steer_per_step * action[1]
        between = self.heading + 0.5 * turned
        chord = rolled * np.sinc(0.5 * turned / math.pi)  # of an arc of length `rolled`
        ahead = np.array([math.cos(between), math.sin(between)])
        self.contact = self.contact - self.p.radius * chord * ahead
        self.heading = within_half_a_turn(self.heading + turned)
        self.phase = within_half_a_turn(self.phase + rolled)
        return self.judge(float(self.p.radius * abs(rolled)))

    def judge(self, cost):
        """Terms and end of the present state."""
        x, y = self.contact / self.p.radius
        m = self.mismatch()
        parked = bool(
            math.hypot(*self.contact) <= self.s.position_tolerance
            and abs(self.heading) <= self.s.heading_tolerance
            and abs(self.phase) <= self.s.phase_tolerance
        )
        terms = {
            "position": -min(math.hypot(x, y), 50.0),
            "heading": -abs(self.heading),
            "side": -math.sqrt(smooth(min(abs(y), 50.0))),
            "mismatch": -float(np.cbrt(smooth(m))),
            "parked": float(parked),
        }
        return Judged(terms, cost, parked, parked)

    def mismatch(self):
        """Of rolled offset and phase."""
        return within_half_a_turn(limited(self.contact[0] / self.p.radius, 50.0) + self.phase)

    def signs(self):
        """Of X and Y."""
        return -1.0 if self.mismatch() < 0.0 else 1.0, -1.0 if self.contact[1] < 0.0 else 1.0

    def reduced(self):
        a, b = self.signs()
        X, Y = np.array([a, b]) * self.features()
        psi, m = a * self.phase, abs(self.mismatch())
        cos, sin = math.cos(self.heading), a * b * math.sin(self.heading)
        ahead, aside = X * cos + Y * sin, Y * cos - X * sin
        room, missing = -psi - ahead, psi**2 - X**2 - Y**2
        first = missing * room / (2.0 * max(room**2, 1e-4))
        rest = limited([room, root(missing)], 10.0)
        roots = (math.sqrt(Y), math.sqrt(m))
        return np.array(
            [X, Y, roots[0], cos, sin, psi, m, roots[1], ahead, aside, *rest, limited(first, 4.0)]
        )

    def turn(self, action):
        a, b = self.signs()
        return np.array([a, a * b]) * action


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


def seen(y):
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


def rate_of_change(y, torque, disk):
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


class DiskRoll(Turning):
    """Keep a disk rolling on a circle."""

    n_action = 1

    def draw(self, rng, params):
        """A start of a wheel with these parameters."""
        p = {**vars(self.s), **params}
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

    def beside(self, aux):
        return {"goal": aux[1]}

    def place(self, q, omega_body, contact, goal):
        self.y = np.array([*q, *omega_body, *contact], dtype=float)
        self.goal = float(goal)
        self.held = Held(self.s.hold, self.s.dt)

    def curvature(self):
        """Curvature of the path of the contact, times the radius."""
        state = seen(self.y)
        psi = state.psi_rate
        return float(limited(state.phi_rate * psi / max(psi * psi, 1e-9), 10.0))

    @property
    def rate(self):
        across = math.hypot(self.y[4], self.y[5]) / math.cos(seen(self.y).lean)
        return float(abs(self.y[6]) + across + math.sqrt(self.p.g / self.p.radius))

    def features(self):
        state = seen(self.y)
        rates = limited([state.theta_rate, state.wn, state.w3], 50.0)
        return np.array([state.lean, *rates, self.curvature(), self.goal])

    def move(self, action):
        torque = self.s.torque * float(action[0])
        u = np.array([0.0, torque, 0.0])
        self.y = moved(lambda y: rate_of_change(y, u, self.p), self.y, self.s.dt)
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

    def reduced(self):
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

    def turn(self, action):
        return action if self.goal >= 0.0 else -action


class DiskRollRandom(DiskRoll):
    """With drawn parameters."""


class RollPump(Model):
    """Roll over the rim of a valley."""

    n_action = 1

    def draw(self, rng, params):
        """A start in a valley with these parameters."""
        part = self.s.start_part * rng.uniform(0.5, 1.0)
        curvature = params.get("curvature", self.s.curvature)
        return {
            "arc_length": rng.choice([-1.0, 1.0]) * part * self.s.rim / curvature,
            "velocity": 0.0,
        }

    def place(self, arc_length, velocity):
        self.y, self.added = np.array([arc_length, velocity]), 0.0

    @property
    def angle(self):
        """From the bottom [rad]."""
        return float(self.p.curvature * self.y[0])

    @property
    def rate(self):
        return float(abs(self.p.curvature * self.y[1]))

    def features(self):
        speed = self.y[1] * math.sqrt(self.p.curvature / self.p.g)
        added = self.added / self.s.beta_change
        return np.array([limited(self.angle, math.pi), limited(speed, 5.0), added])

    def move(self, action):
        before, self.added = self.added, 0.5 * self.s.beta_change * (1.0 + float(action[0]))
        ratio = 1.0 + self.p.beta + self.added
        self.y[1] *= (1.0 + self.p.beta + before) / ratio
        self.y = moved(
            lambda y: [y[1], -self.p.g * math.sin(self.p.curvature * y[0]) / ratio],
            self.y,
            self.s.dt,
            has_attitude=False,
        )
        kinetic = 0.5 * ratio * self.y[1] ** 2 * self.p.curvature / self.p.g
        energy = 1.0 - math.cos(self.angle) + kinetic
        over = abs(self.angle) >= self.s.rim
        shortfall = energy / (1.0 - math.cos(self.s.rim)) - 1.0
        terms = {"shortfall": float(np.clip(shortfall, -1.0, 0.0)), "over": float(over)}
        return Judged(terms, self.s.dt, over, over)

    def reduced(self):
        low, top = 1.0 + self.p.beta, math.sin(0.5 * self.s.rim)
        x = math.sin(0.5 * self.angle) / top
        momentum = (low + self.added) * self.y[1]
        w = momentum * math.sqrt(self.p.curvature / (self.p.g * low)) / (2.0 * top)
        energy = x * x + w * w
        least = max(energy, 1e-12)
        cos, sin = (x * x - w * w) / least, 2.0 * x * w / least
        size = limited(-math.log(least), 10.0)
        return np.array([cos, sin, limited(4.0 * sin, 1.0), min(energy, 4.0), size])

    def turn(self, action):
        return action
