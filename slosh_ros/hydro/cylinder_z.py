"""
Upright circular cylinder by closed form (THEORY 4, "Vertical cylinder").

With the zeros e_1 < e_2 < ... of J_1', in polar coordinates r, theta about the axis,

    phi = c J_1(e r/R) cosh(e (z + d)/R)/cosh(e d/R) (cos theta or sin theta),
    kappa = (e/R) tanh(e d/R).

Only these modes of one nodal diameter couple. In each pair the cosine mode takes surge and pitch,
the sine mode sway and roll; yaw takes none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ive, j1, jnp_zeros

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import (
    Array,
    ModalCoefficients,
    diametral_names,
    disc_points,
    still_coefficients,
)
from slosh_ros.hydro.hyperbolic import cosh_ratio
from slosh_ros.tank.upright import UprightCylinder

_SERIES_TERMS = 200  # of the inertia sum, whose terms fall as m^-5: 1e-12 of the sum is left
_POTENTIAL_TERMS = 500  # fall as m^-3: at the wall 7e-8 of the depth squared is left


def cylinder_z_coefficients(
    tank: UprightCylinder, depth: float, density: float, modes: int
) -> ModalCoefficients:
    """
    Closed-form coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    tank : UprightCylinder
        The tank.
    depth : float
        Depth of the liquid [m]; a full tank has no modes.
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes. The modes of a pair, `x1` and `y1`, `x3` and `y3`, ..., have the same
        frequency; of the last pair an odd number keeps only the surge mode.

    Returns
    -------
    ModalCoefficients
        About O, the centre of the mean free surface, in tank axes.
    """
    radius = tank.radius
    if depth == tank.height:
        none = np.zeros(0)
        return still_coefficients(
            'closed form',
            density,
            tank.filled(depth),
            density * _stokes_joukowski(radius, depth),
            _Potentials(radius, depth, none, none.astype(bool), none),
        )
    zeros = jnp_zeros(1, (modes + 1) // 2)
    e = np.repeat(zeros, 2)[:modes]
    sine = np.arange(modes) % 2 == 1
    kappa = e / radius * np.tanh(e * depth / radius)
    # J_1 is largest at its first stationary point: within the surface for all pairs but the first
    wall = np.abs(j1(e)) / j1(zeros[0])  # |f| at the wall, with max |f| = 1

    coupling = np.zeros((modes, 6))
    push = -density * np.pi * radius**3 / e**2 * wall  # eqs (11), (12)
    lever = 2.0 * radius * np.tanh(e * depth / (2.0 * radius)) / e
    coupling[~sine, 0] = push[~sine]
    coupling[~sine, 4] = -(push * lever)[~sine]
    coupling[sine, 1] = push[sine]
    coupling[sine, 3] = (push * lever)[sine]

    points = disc_points(radius)
    potentials = _Potentials(radius, depth, e, sine, -wall / j1(e))
    return ModalCoefficients(
        route='closed form',
        density=density,
        liquid=tank.filled(depth),
        names=diametral_names(modes),
        omega=np.sqrt(GRAVITY * kappa),
        mu=density * np.pi * radius**2 / (2.0 * kappa) * (1.0 - 1.0 / e**2) * wall**2,  # eq (10)
        coupling=coupling,
        inertia_stokes_joukowski=density * _stokes_joukowski(radius, depth),
        wall_friction=_wall_friction(radius, depth, e),
        surface_points=points,
        surface_shapes=potentials.modes(np.pad(points, ((0, 0), (0, 1)))),
        potentials=potentials,
    )


@dataclass(frozen=True, eq=False)
class _Potentials:
    """Odd in x or y, so that the means of Omega_4 and Omega_5 over the surface are zero."""

    radius: float
    depth: float
    e: Array
    sine: NDArray[np.bool_]
    scale: Array

    def modes(self, points: Array) -> Array:
        x, y, z = points.T[..., np.newaxis]
        r, theta, k = np.hypot(x, y), np.arctan2(y, x), self.e / self.radius
        around = np.where(self.sine, np.sin(theta), np.cos(theta))
        return np.asarray(self.scale * j1(k * r) * around * cosh_ratio(k, z, self.depth))

    def stokes_joukowski(self, points: Array) -> Array:
        # the docstring of _stokes_joukowski; Omega_4 is -Omega_5 turned by a right angle
        x, y, z = points.T
        above, r = z + self.depth, np.hypot(x, y)
        m = np.arange(1, 2 * _POTENTIAL_TERMS, 2)
        q = m * np.pi / self.depth
        s, qr = q * self.radius, np.outer(r, q)
        slope = s * (ive(0, s) + ive(2, s)) / 2.0  # of I_1 at the wall, times s
        rise = ive(1, qr) * np.exp(qr - s) * self.radius / slope
        series = 8.0 * self.depth / (np.pi * m) ** 2 * np.cos(np.outer(above, q)) * rise
        axial = above + np.sum(series, axis=1) / np.where(r > 0.0, r, 1.0)
        return np.stack([y * axial, -x * axial, np.zeros_like(x)], axis=-1)


def _wall_friction(radius: float, depth: float, e: Array) -> Array:
    """
    Half the wall integral over the volume integral of the squared velocity [1/m].

    Case & Parkinson (1957), J. Fluid Mech. 2.
    """
    k = e / radius
    sech_2, tanh = 1.0 / np.cosh(np.minimum(k * depth, 300.0)) ** 2, np.tanh(k * depth)
    # over the depth: integrals of cosh^2 and sinh^2 k(z + d), over cosh^2 kd
    cosh_2, sinh_2 = (tanh / (2.0 * k) + sign * depth / 2.0 * sech_2 for sign in (1.0, -1.0))
    surface = radius / 2.0 * (1.0 - 1.0 / e**2)  # integral of f^2 dS, over pi R and the wall's f^2
    wall = cosh_2 / radius**2 + k**2 * sinh_2
    bottom = k**2 * surface * sech_2
    friction: Array = (wall + bottom) / (2.0 * k * tanh * surface)
    return friction


def _stokes_joukowski(radius: float, depth: float) -> Array:
    """
    Inertia of the liquid under a closed lid about O, for unit density [m^5].

    Omega_5 = -x z - d x - (8 d/pi^2) cos theta sum_m cos(q (z + d)) I_1(q r)/(m^2 q I_1'(q R))
    over odd m, with q = m pi/d, obeys dOmega_5/dn = z n_1 - x n_3 on bottom, wall and lid. Its
    energy is

        J_55 = pi R^4 d/4 + (32 d^3 R^2/pi^3) sum_m I_1(s)/(s I_1'(s)) / m^4,   s = q R.

    J_44 is the same; about the axis of symmetry the wall takes nothing along, J_66 = 0.
    """
    m = np.arange(1, 2 * _SERIES_TERMS, 2)
    s = m * np.pi * radius / depth
    ratio = 2.0 * ive(1, s) / (s * (ive(0, s) + ive(2, s)))  # scaled: exp(s) cancels
    ends = 32.0 * depth**3 * radius**2 / np.pi**3 * float(np.sum(ratio / m**4.0))
    across = np.pi * radius**4 * depth / 4.0 + ends
    return np.diag([across, across, 0.0])
