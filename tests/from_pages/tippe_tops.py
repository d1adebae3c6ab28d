"""The tippe top, written again from its page alone."""

import numpy as np

from tests.from_pages.attitudes import matrix, quaternion_rate, tilted
from tests.from_pages.model import Frame, Page, limited
from tests.vectors import cross

E_Z = np.array([0.0, 0.0, 1.0])


class TippeTop(Page):
    """docs/environments/TippeTop.md."""

    physical = ("m", "radius", "offset", "I1", "I3", "g", "mu", "slip_speed", "drag")
    n_action = 1
    ACCEPTED = 1.0

    def components(self, y):
        names = ("q", "omega_body", "centre", "velocity")
        return dict(zip(names, np.split(y, [4, 7, 9]), strict=True))

    @property
    def moments(self):
        """Of the top of the episode."""
        return np.array([self.I1, self.I1, self.I3])

    @property
    def R(self):
        """Attitude."""
        return matrix(self.y[:4])

    @property
    def rate(self):
        """Of the turns, of gravity, of friction."""
        turns = np.linalg.norm(self.omega * [1.0, 1.0, max(1.0, self.I3 / self.I1)])
        swing = np.sqrt(self.m * self.g * self.offset / self.I1)
        arm = (self.radius + self.offset) ** 2
        slows = (
            self.g
            * (self.mu / self.slip_speed + self.drag)
            * (1 + self.m * arm / min(self.I1, self.I3))
        )
        return turns + swing + slows

    def rhs(self, y, u):
        """Newton's and Euler's laws in world axes; the height z = r - a R33 asks for N."""
        R, omega = matrix(y[:4]), y[4:7]
        axis, turns = R[:, 2], R @ omega
        inverse = R @ np.diag(1.0 / self.moments) @ R.T
        to_contact = self.offset * axis - self.radius * E_Z
        slip = np.array([*y[9:11], -self.offset * cross(turns, axis)[2]]) + cross(turns, to_contact)
        f = self.mu / np.sqrt(slip @ slip + self.slip_speed**2) + self.drag
        push = -f * slip
        # omega' = free + N forced, in world axes
        free = R @ self.spun(omega, u[:3])
        forced = inverse @ cross(to_contact, E_Z + push)
        bent = cross(turns, cross(turns, axis))
        fall = -self.offset * (cross(free, axis) + bent)[2]
        lift = -self.offset * cross(forced, axis)[2]
        N = self.m * (self.g + fall) / (1.0 - self.m * lift)
        spin = R.T @ (free + N * forced)
        force = (N * push[:2] + u[3:]) / self.m
        return np.concatenate([quaternion_rate(y[:4], omega), spin, y[9:11], force])

    def input_of(self, action):
        return np.array([0.0, 0.0, self.torque * action[0], 0.0, 0.0])

    def features(self):
        return np.concatenate([limited(self.R @ self.omega, 30.0), limited(self.y[9:11], 30.0)])

    def values(self, u):
        return {"inverted": (1 - self.R[2, 2]) / 2, "effort": -abs(u[2]) / self.torque}

    def success(self):
        return self.held(np.arccos(limited(self.R[2, 2], 1.0)) > np.pi - self.tolerance)

    def draw_state(self, rng):
        """A slow spin about a leaning axis."""
        tilt = rng.uniform(self.start_tilt_low, self.start_tilt_high)
        r, a = self.radius, self.offset
        lever = r * (self.I1 * r - self.I3 * (r - a))
        n = (r - a) * np.sqrt(self.m * self.g * a / lever)
        spin = rng.choice([-1.0, 1.0]) * n * rng.uniform(self.start_spin_low, self.start_spin_high)
        return np.concatenate([tilted(rng, tilt), [0.0, 0.0, spin], np.zeros(4)])

    # -- reduced frame, of the top in the middle of the ranges

    def slip(self):
        """v of the page."""
        a, r = self.middle("offset"), self.middle("radius")
        arm = a * self.R[:, 2] - r * E_Z
        return self.y[9:11] + cross(self.R @ self.omega, arm)[:2]

    def jellett(self):
        """J of the page, and the J that the inverted top needs."""
        a, r, I1, I3 = (self.middle(name) for name in ("offset", "radius", "I1", "I3"))
        L = np.array([I1, I1, I3]) * self.omega
        J = (self.R @ L)[2] * r - a * L[2]
        square = self.middle("m") * self.middle("g") * a * (r + a) ** 2
        n = np.sqrt(square / (r * (I3 * (r + a) - I1 * r)))
        return J, I3 * n * (r + a)

    def frame_now(self):
        """Along the lean; along the slip where there is none."""
        side = -1.0 if self.jellett()[0] < 0.0 else 1.0
        for x, y in (self.R[:2, 2], self.slip()):
            if x * x + y * y >= 1e-18:
                length = np.hypot(x, y)
                return Frame(float(x / length), float(y / length), side)
        return Frame(1.0, 0.0, side)

    def reduced(self):
        """Section *Reduced Frame*."""
        frame = self.frame_now()
        J, needed = self.jellett()
        return [
            frame.seen(*self.R[:2, 2])[0],
            self.R[2, 2],
            *limited(frame.axial(self.R @ self.omega), 30.0),
            limited(frame.side * self.omega[2], 30.0),
            *limited(frame.seen(*self.slip()), 30.0),
            min(abs(J) / needed, 20.0),
        ]

    def turn(self, action):
        return self.frame_now().side * action
