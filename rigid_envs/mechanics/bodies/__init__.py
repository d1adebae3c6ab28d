"""Mass properties of rigid bodies: solids, laminae, points, meshes, densities, compositions.

Conventions. SI units. A `Body` has a mass [kg], a centre of mass [m] and an inertia tensor about
it [kg m^2], I_ij = sum m (r^2 d_ij - r_i r_j), all in the axes in which it was constructed; these
are fixed in the body, so angular velocities `omega_body` are in them too. What moves a body
(`rotated`, `translated`, `compose`) takes a point from x to R x + d; attitudes are rotation
matrices (3, 3) or unit quaternions (w, x, y, z), body to world.

The constructors put the special axis of a body along z and its centre of mass into the origin,
but for `cone`, `conical_shell` (apex in the origin, opening along z) and `hemisphere` (flat side
in the plane z = 0, dome above). Bad input is refused with a `ValueError`.
"""

from rigid_envs.mechanics.bodies.body import (
    Body,
    InertiaEllipsoid,
    Kind,
    PrincipalAxes,
    compose,
    point_masses,
    tetrahedron,
)
from rigid_envs.mechanics.bodies.densities import Region, from_density, from_mesh
from rigid_envs.mechanics.bodies.named import (
    american_football,
    book,
    coin,
    earth,
    frisbee,
    t_handle,
    tennis_racket,
)
from rigid_envs.mechanics.bodies.solids import (
    annulus,
    box,
    capsule,
    cone,
    conical_shell,
    cylindrical_shell,
    disk,
    ellipsoid,
    elliptic_lamina,
    hemisphere,
    hollow_cylinder,
    hollow_sphere,
    hoop,
    perpendicular_axis,
    rectangular_lamina,
    rod,
    solid_cylinder,
    solid_sphere,
    thick_shell,
    torus,
    triangular_lamina,
)

__all__ = [
    "Body",
    "InertiaEllipsoid",
    "Kind",
    "PrincipalAxes",
    "Region",
    "american_football",
    "annulus",
    "book",
    "box",
    "capsule",
    "coin",
    "compose",
    "cone",
    "conical_shell",
    "cylindrical_shell",
    "disk",
    "earth",
    "ellipsoid",
    "elliptic_lamina",
    "frisbee",
    "from_density",
    "from_mesh",
    "hemisphere",
    "hollow_cylinder",
    "hollow_sphere",
    "hoop",
    "perpendicular_axis",
    "point_masses",
    "rectangular_lamina",
    "rod",
    "solid_cylinder",
    "solid_sphere",
    "t_handle",
    "tennis_racket",
    "tetrahedron",
    "thick_shell",
    "torus",
    "triangular_lamina",
]
