"""
Rectangular tank by closed form (THEORY 3).

Modes (a, b): f = cos k_a(x + L/2) cos k_b(y + B/2) with k_a = pi a/L, k_b = pi b/B, and
phi = f cosh k(z + d)/cosh kd, kappa = k tanh kd, k^2 = k_a^2 + k_b^2.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import (
    Array,
    ModalCoefficients,
    mode_name,
    still_coefficients,
    surface_grid,
)
from slosh_ros.hydro.hyperbolic import cosh_ratio, sinh_ratio
from slosh_ros.tank import Rectangle, UniformTank

_SERIES_TERMS = 200  # of the inertia sums, whose terms fall as m^-5: 1e-12 of the sum is left
_POTENTIAL_TERMS = 500  # fall as m^-3: at a wall 7e-8 of the square of its extent is left


def rectangular_coefficients(
    tank: UniformTank, depth: float, density: float, modes: int
) -> ModalCoefficients:
    """
    Closed-form coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    tank : UniformTank
        Of rectangular section.
    depth : float
        Depth of the liquid [m]; a full tank has no modes.
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes.

    Raises
    ------
    TypeError
        If the section is not a rectangle.
    """
    if not isinstance(tank.section, Rectangle):
        raise TypeError('the closed form needs a rectangular section')
    length, width = tank.length, tank.section.width
    if depth == tank.height:
        none = np.zeros(0)
        return still_coefficients(
            'closed form',
            density,
            tank.filled(depth),
            density * _stokes_joukowski(length, width, depth),
            _Potentials(length, width, depth, none, none),
        )
    pairs = _lowest_coupling_pairs(length, width, modes)
    a, b = np.array(pairs, dtype=float).T
    k_a, k_b = np.pi * a / length, np.pi * b / width
    k = np.hypot(k_a, k_b)
    kappa = k * np.tanh(k * depth)
    plan = length * width / np.where((a > 0) & (b > 0), 4.0, 2.0)  # integral of f^2 dS

    coupling = np.zeros((len(pairs), 6))
    surge, sway, yaw = b == 0, a == 0, (a > 0) & (b > 0)
    moment_arm = 2.0 * np.tanh(k * depth / 2.0) / k
    coupling[surge, 0] = -2.0 * density * width / k[surge] ** 2
    coupling[surge, 4] = -coupling[surge, 0] * moment_arm[surge]
    coupling[sway, 1] = -2.0 * density * length / k[sway] ** 2
    coupling[sway, 3] = coupling[sway, 1] * moment_arm[sway]
    coupling[yaw, 5] = 4.0 * density * (k_b**2 - k_a**2)[yaw] / (k_a[yaw] * k_b[yaw] * k[yaw]) ** 2

    points = surface_grid(length, width)
    shapes = np.cos(np.outer(points[:, 0] + length / 2.0, k_a)) * np.cos(
        np.outer(points[:, 1] + width / 2.0, k_b)
    )
    return ModalCoefficients(
        route='closed form',
        density=density,
        liquid=tank.filled(depth),
        names=tuple(mode_name(int(i), int(j)) for i, j in pairs),
        omega=np.sqrt(GRAVITY * kappa),
        mu=density * plan / kappa,  # eq (10)
        coupling=coupling,
        inertia_stokes_joukowski=density * _stokes_joukowski(length, width, depth),
        wall_friction=_wall_friction(length, width, depth, k_a, k_b),
        surface_points=points,
        surface_shapes=shapes,
        potentials=_Potentials(length, width, depth, k_a, k_b),
    )


@dataclass(frozen=True, eq=False)
class _Potentials:
    """THEORY 3; Omega_4 to Omega_6 are odd in y or x, so that their means are zero."""

    length: float
    width: float
    depth: float
    k_a: Array
    k_b: Array

    def modes(self, points: Array) -> Array:
        x, y, z = points.T[..., np.newaxis]
        plan = np.cos(self.k_a * (x + self.length / 2.0)) * np.cos(
            self.k_b * (y + self.width / 2.0)
        )
        return np.asarray(plan * cosh_ratio(np.hypot(self.k_a, self.k_b), z, self.depth))

    def stokes_joukowski(self, points: Array) -> Array:
        x, y, z = points.T
        length, width, depth = self.length, self.width, self.depth
        above = z + depth
        return np.stack(
            [
                y * above + _between_walls(y, above, width, depth),
                -x * above - _between_walls(x, above, length, depth),
                x * y + _between_walls(x, y + width / 2.0, length, width),
            ],
            axis=-1,
        )


def _between_walls(u: Array, v: Array, span: float, side: float) -> Array:
    """
    Harmonic function w(u, v) of zero slope at v = 0 and v = side.

    At the walls u = -span/2, span/2 its slope dw/du is side - 2 v.
    """
    q = np.pi / side * np.arange(1, 2 * _POTENTIAL_TERMS, 2, dtype=float)
    series = 8.0 / (side * q**2) * np.cos(np.outer(v, q))
    return np.asarray(np.sum(series * sinh_ratio(q, u[:, np.newaxis], span / 2.0), axis=1))


def _lowest_coupling_pairs(length: float, width: float, modes: int) -> list[tuple[int, int]]:
    """Pairs (a, b) that couple (each odd or zero), by rising wave number, hence frequency."""
    orders = [0, *range(1, 2 * modes, 2)]
    coupling = [
        (a, b)
        for a, b in itertools.product(orders, orders)
        # a square plan leaves lambda_6 = 0 for a = b
        if (a or b) and not (a and b and np.isclose(a / length, b / width, rtol=1e-12))
    ]
    return sorted(coupling, key=lambda ab: (np.hypot(ab[0] / length, ab[1] / width), ab[1]))[
        :modes
    ]


def _wall_friction(length: float, width: float, depth: float, k_a: Array, k_b: Array) -> Array:
    """Half the wall over the volume integral of |grad phi|^2, tangential at the wall [1/m]."""
    k = np.hypot(k_a, k_b)
    sech = 1.0 / np.cosh(np.minimum(k * depth, 300.0))  # whose square is 0 then
    # integrals over the depth of cosh^2 and sinh^2 k(z + d), over cosh^2 kd
    cosh2, sinh2 = (np.tanh(k * depth) / (2.0 * k) + s * depth / 2.0 * sech**2 for s in (1, -1))
    cos_x, sin_x = length / np.where(k_a > 0, 2.0, 1.0), length / 2.0 * (k_a > 0)
    cos_y, sin_y = width / np.where(k_b > 0, 2.0, 1.0), width / 2.0 * (k_b > 0)
    sides = 2.0 * (k_a**2 * sin_x * cosh2 + k**2 * cos_x * sinh2)
    ends = 2.0 * (k_b**2 * sin_y * cosh2 + k**2 * cos_y * sinh2)
    plan = cos_x * cos_y
    bottom = k**2 * plan * sech**2
    return np.asarray((sides + ends + bottom) / (2.0 * k * np.tanh(k * depth) * plan))


def _stokes_joukowski(length: float, width: float, depth: float) -> Array:
    """Inertia of the liquid under a closed lid about O, for unit density [m^5]."""
    m = np.arange(1, 2 * _SERIES_TERMS, 2)

    def edge_sum(span: float, side: float) -> float:
        return float(
            64.0 * side**4 / np.pi**5 * np.sum(np.tanh(m * np.pi * span / 2 / side) / m**5.0)
        )

    # J_44, J_55, J_66 of THEORY 3
    roll = length * (depth * width**3 / 12.0 + edge_sum(width, depth))
    pitch = width * (depth * length**3 / 12.0 + edge_sum(length, depth))
    yaw = depth * (width * length**3 / 12.0 - length * width**3 / 4.0 + edge_sum(length, width))
    return np.diag([roll, pitch, yaw])
