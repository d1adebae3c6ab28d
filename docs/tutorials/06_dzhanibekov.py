# %% [markdown]
# # Lecture: the Dzhanibekov effect
#
# In 1985 the cosmonaut Vladimir Dzhanibekov unscrewed a wing nut in orbit. It flew off its bolt,
# spinning, and after some distance turned over by itself, and then back again, with no torque on it.
# A tennis racket that is thrown about its intermediate axis does the same in the hand. Nothing but
# Euler's equations is at work. This lecture solves them, says when the body turns over, how well that
# can be predicted, and how a controller prevents it.

# %%
import matplotlib.pyplot as plt
import numpy as np

from rigid_envs.control import simulate_closed_loop
from rigid_envs.mechanics.bodies import t_handle
from rigid_envs.systems import FreeBody
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.controllers import SingleTorque

handle = t_handle().principal()
body = FreeBody(*handle.moments)
print(f"moments of an aluminium T [kg m^2]: {body.moments}")

# %% [markdown]
# ## Euler's equations
#
# Without torque the angular momentum $L$ is constant in space. In axes that turn with the body, the
# principal axes, $L = (I_1 \omega_1, I_2 \omega_2, I_3 \omega_3)$ and
#
# $$
# I_1 \dot\omega_1 = (I_2 - I_3)\, \omega_2 \omega_3, \qquad
# I_2 \dot\omega_2 = (I_3 - I_1)\, \omega_3 \omega_1, \qquad
# I_3 \dot\omega_3 = (I_1 - I_2)\, \omega_1 \omega_2 .
# $$
#
# Take $I_1 < I_2 < I_3$. Spin about one axis is a solution. Beside a spin $\Omega$ about $e_2$, the
# small components obey $\dot\omega_1 = -\frac{I_3 - I_2}{I_1} \Omega\, \omega_3$ and
# $\dot\omega_3 = -\frac{I_2 - I_1}{I_3} \Omega\, \omega_1$. Both coefficients have the same sign, so the
# solutions are not oscillations but exponentials $e^{\pm \lambda t}$ with the growth rate
#
# $$
# \lambda = \Omega \sqrt{\frac{(I_2 - I_1)(I_3 - I_2)}{I_1 I_3}} .
# $$
#
# About $e_1$ and $e_3$ the signs differ, and small departures oscillate. We let the T fly, spun about
# its stem with one per cent of error.

# %%
Omega = 1.0
omega0 = np.array([0.01, 1.0, 0.01]) * Omega
t = np.linspace(0.0, 120.0, 2401)
flight = body.simulate(body.state(omega_body=omega0), t)

figure, axes = plt.subplots(figsize=(7, 2.8), layout="constrained")
axes.plot(t, flight["omega_body"], label=[r"$\omega_1$", r"$\omega_2$", r"$\omega_3$"])
axes.set(xlabel="time [s]", ylabel=r"$\omega$ [rad/s]", title="A T-handle in free flight")
axes.legend(loc="right")
plt.show()

# %% [markdown]
# Here is the growth, on a logarithmic scale. The slope of the dashed line is $\lambda$, computed from
# the moments. The combination $d = \omega_1 - r\, \omega_3$ with $r^2 = I_3 (I_3 - I_2) / I_1 (I_2 - I_1)$
# is the part that grows; the other combination decays.

# %%
I1, I2, I3 = body.moments
growth = free_body.growth_rate(body.moments, Omega)
r = np.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))
small = body.simulate(body.state(omega_body=[1e-6, Omega, 0.0]), t)
d = np.abs(small["omega_body"] @ [1.0, 0.0, -r])

figure, axes = plt.subplots(figsize=(7, 2.8), layout="constrained")
axes.semilogy(t, d, label="simulated")
axes.semilogy(t, d[0] * np.exp(growth * t), "k--", label=r"$e^{\lambda t}$")
axes.set(xlabel="time [s]", ylabel=r"$|d|$ [rad/s]", ylim=(1e-7, 20.0))
axes.legend()
plt.show()
print(f"lambda = {growth:.4f} 1/s: a factor of ten in {np.log(10.0) / growth:.1f} s")

# %% [markdown]
# ## Polhodes
#
# Two quantities are conserved: the energy and the length of the angular momentum,
#
# $$
# 2T = I_1 \omega_1^2 + I_2 \omega_2^2 + I_3 \omega_3^2, \qquad
# L^2 = I_1^2 \omega_1^2 + I_2^2 \omega_2^2 + I_3^2 \omega_3^2 .
# $$
#
# Each is an ellipsoid in the space of $\omega$; the motion runs along their intersection, the
# *polhode*. About $e_1$ and $e_3$ polhodes are small closed curves. At $e_2$ two curves cross, the
# *separatrices*, on which $L^2 = 2 T I_2$. A motion that starts beside $e_2$ stays close to a separatrix
# as far as $-e_2$, on the other side: that is the flip.

# %%
figure = plt.figure(figsize=(5.6, 5.0))
axes = figure.add_subplot(projection="3d", proj_type="ortho")
axes.view_init(elev=22, azim=35)


def draw(start: np.ndarray, **style: object) -> None:
    """Draw the polhode through a point, once round."""
    curve = free_body.polhode(body.moments, start)
    times = np.linspace(0.0, curve.period, 600)
    style = {"color": "C0" if curve.axes[2] == 0 else "C2", "linewidth": 0.9} | style
    axes.plot(*free_body.omega(times, body.moments, start).T, **style)


# points of equal energy in the plane of e1 and e3, which every polhode but the separatrices crosses
semi_axes = np.sqrt(I2 * Omega**2 / body.moments)
for angle in np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False) + 0.02:
    draw(semi_axes * [np.cos(angle), 0.0, np.sin(angle)])
for error in (1e-6, -1e-6):
    draw(np.array([error, Omega, 0.0]), color="C3", linewidth=1.8)
    draw(np.array([0.0, Omega, error]), color="C3", linewidth=1.8)
axes.set(xlabel=r"$\omega_1$", ylabel=r"$\omega_2$", zlabel=r"$\omega_3$")
axes.set_title("Polhodes about $e_1$ (blue) and $e_3$ (green); separatrices in red")
axes.set_aspect("equal")
for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
    axis.set_ticks([-0.5, 0.0, 0.5])
plt.show()

# %% [markdown]
# ## When it flips
#
# With the two conserved quantities one equation of first order is left. Its solutions are Jacobi's
# elliptic functions: for a polhode about $e_3$
#
# $$
# \omega_1 = a_1 \operatorname{cn} u, \qquad \omega_2 = a_2 \operatorname{sn} u, \qquad
# \omega_3 = a_3 \operatorname{dn} u, \qquad u = u_0 + p\, t .
# $$
#
# The sign of $\omega_2$ changes every $2 K(m) / p$, with $K$ the complete elliptic integral of the first
# kind: that is the time from flip to flip. `rigid_envs.systems.free_body.closed_forms` evaluates this with 1 - $m$ as the
# parameter, so that it stays exact close to the separatrix. It shares no formula with the simulation.

# %%
path = free_body.polhode(body.moments, omega0)
exact = free_body.omega(t, body.moments, omega0)
crossings = t[1:][np.diff(np.sign(flight["omega_body"][:, 1])) != 0]
print(f"time from flip to flip, elliptic integral  {path.flip_interval:.4f} s")
print(f"between sign changes in the simulation     {np.diff(crossings).mean():.2f} s, in a grid")
print(
    f"largest difference of omega in {t[-1]:.0f} s        {np.abs(flight['omega_body'] - exact).max():.1e} rad/s"
)

# %% [markdown]
# ## How well it can be predicted
#
# Near the separatrix $K(m) \approx \ln(4 / \sqrt{1 - m})$, and $\sqrt{1 - m}$ is proportional to the
# error $\varepsilon$ of the launch. So the interval between flips grows only with the logarithm:
#
# $$
# T_\text{flip} \approx \frac{2}{p} \ln \frac{\text{const}}{\varepsilon} ,
# $$
#
# and each decimal of care buys $\ln(10) \cdot 2 / p$ seconds. Nobody can throw a racket so well that it
# does not flip. Conversely, an error of the launch that is not known by a factor $x$ shifts the flip by
# $\frac{2}{p} \ln x$: a bounded uncertainty, and no chaos, for the motion is periodic.

# %%
errors = np.logspace(-12, -1, 45)
curves = [free_body.polhode(body.moments, [eps * Omega, Omega, 0.0]) for eps in errors]

figure, axes = plt.subplots(figsize=(7, 2.8), layout="constrained")
axes.semilogx(errors, [curve.flip_interval for curve in curves], label="elliptic integral")
axes.semilogx(errors, [curve.flip_asymptote for curve in curves], "k--", label="asymptote")
axes.set(xlabel=r"error of the launch, $\omega_1 / \Omega$", ylabel="flip to flip [s]")
axes.legend()
plt.show()
per_decimal = 2.0 / abs(curves[0].rate) * np.log(10.0)
print(f"each decimal of care delays the flip by {per_decimal:.2f} s")

# %% [markdown]
# ## Holding the intermediate axis
#
# A torque about one axis is enough. Bloch and Marsden (1990) take $\tau_3 = \epsilon\, \omega_1 \omega_2 -
# k\, \omega_3$. Euler's third equation becomes
#
# $$
# I_3 \dot\omega_3 = \bigl(\epsilon - (I_2 - I_1)\bigr)\, \omega_1 \omega_2 - k\, \omega_3 :
# $$
#
# for $\epsilon > I_2 - I_1$ the gyroscopic term has the other sign, exponentials become oscillations, and
# $k$ damps them. `SingleTorque` is this law, with its Lyapunov function. The body is now that of the
# environment `IntermediateAxisSingle`, with moments 1, 2 and 3, and the law is sampled ten times a
# second, as it is there.

# %%
model = FreeBody(1.0, 2.0, 3.0)
dt, steps = 0.1, 400
start = model.state(omega_body=[0.1, 1.0, 0.1])
figure, axes = plt.subplots(1, 2, figsize=(7.4, 2.8), sharey=True, layout="constrained")
for strength, title, panel in ((0.5, "too weak", axes[0]), (3.0, "strong enough", axes[1])):
    law = SingleTorque(model, rate=1.0, torque=0.45, strength=strength)
    states = simulate_closed_loop(
        lambda y, law=law: model.advance(y, law.inputs(law(y)), dt, 2), start, steps
    )
    panel.plot(dt * np.arange(steps + 1), model.omega_body(states))
    panel.set(xlabel="time [s]", title=rf"{title}: $\epsilon = {strength}\,(I_2 - I_1)$")
    print(f"strength {strength}: exponents {np.round(law.exponents(), 3)} 1/s")
axes[0].set_ylabel(r"$\omega$ [rad/s]")
axes[1].legend([r"$\omega_1$", r"$\omega_2$", r"$\omega_3$"], loc="right")
plt.show()

# %% [markdown]
# A linear-quadratic regulator with three torques does it with less impulse, and a learnt policy from
# rewards alone: see the scores on the pages of
# [`IntermediateAxis`](../environments/IntermediateAxis.md) and
# [`IntermediateAxisSingle`](../environments/IntermediateAxisSingle.md).
# [`AxisFlip`](../environments/AxisFlip.md) asks for the contrary: to flip on command, for the least
# impulse, along the separatrix.
#
# ## Exercises
#
# 1. The flips of the first figure are fast, the waiting long. Show from the asymptote that the duration
#    of a flip hardly depends on $\varepsilon$.
# 2. Make the stem of the T longer: `t_handle(stem_length=0.14)`. For which lengths is the moment about
#    the stem no longer the intermediate one?
# 3. A body with internal damping loses energy but not $L$. Where on the ellipsoid does it end? (Explorer 1
#    was launched in 1958 in the belief that it would stay where it began.)
#
# ## Sources
#
# Landau & Lifshitz, *Mechanics*, section 37; Goldstein, Poole & Safko, *Classical Mechanics*, sections
# 5.6 and 5.7; Ashbaugh, Chicone & Cushman 1991, "The twisting tennis racket",
# [doi:10.1007/BF01049489](https://doi.org/10.1007/BF01049489); Bloch & Marsden 1990,
# [doi:10.1016/0167-6911(90)90055-Y](https://doi.org/10.1016/0167-6911(90)90055-Y).
