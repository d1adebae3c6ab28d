"""The heavy symmetric top in closed form: Lagrange's top, pivot fixed, gravity along -z.

Moments about the pivot are I = i_perp (transverse) and I3 = i3 (axial), the centre of mass lies at
distance ell along +e3, mgl = m g ell. theta is the tilt of e3 from the vertical, u = cos theta,
omega3 the (constant) axial angular velocity, phi' the precession. With the energy E and the momenta
p_phi (vertical) and p_psi = I3 omega3 (axial),

    alpha = (2 E - I3 omega3^2) / I,  beta = 2 mgl / I,  a = p_psi / I,  b = p_phi / I.

Sources: Goldstein, Classical Mechanics, sec. 5.7; Landau & Lifshitz, Mechanics, par. 35;
Whittaker, Analytical Dynamics, ch. VI.
"""

from rigid_envs.analytic.heavy_top._fast import FastTop, fast_top
from rigid_envs.analytic.heavy_top._nutation import Nutation, nutation, tilt
from rigid_envs.analytic.heavy_top._precession import Precession, precession
from rigid_envs.analytic.heavy_top._sleeping import (
    homoclinic_tilt,
    sleeping_exponents,
    sleeping_threshold,
)
from rigid_envs.analytic.heavy_top._start import Invariants, invariants
from rigid_envs.analytic.heavy_top._steady_top import (
    effective_potential,
    nutation_frequency,
    steady_precession,
    steady_threshold,
)
from rigid_envs.analytic.heavy_top._top_attitude import attitude, euler_angles, omega

__all__ = [
    "FastTop",
    "Invariants",
    "Nutation",
    "Precession",
    "attitude",
    "effective_potential",
    "euler_angles",
    "fast_top",
    "homoclinic_tilt",
    "invariants",
    "nutation",
    "nutation_frequency",
    "omega",
    "precession",
    "sleeping_exponents",
    "sleeping_threshold",
    "steady_precession",
    "steady_threshold",
    "tilt",
]
