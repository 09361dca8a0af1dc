"""
Tank of uniform section with flat ends (THEORY 4).

A mode is phi = cos k(x + L/2) psi(y, z) with k = a pi/L. In the section, psi obeys

    lap psi = k^2 psi,  dpsi/dn = 0 on the wall,  dpsi/dz = kappa psi on the free surface,

in weak form (K + k^2 M) psi = kappa S psi. It is even or odd in y, so that half the section will
do. Surge (a odd, psi even), sway (a = 0, psi odd) and yaw (a odd, psi odd) are all that couple
with the motion of the tank. K and M do not know k: their eigenpairs serve every a.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import Array, ModalCoefficients, mode_name, surface_grid
from slosh_ros.hydro.hyperbolic import sinh_ratio
from slosh_ros.hydro.section_mesh import DEFAULT, HalfSection, Resolution, half_section
from slosh_ros.tank import UniformTank

# A mode couples if its share lambda^2/mu of the mass, or of a moment of inertia, of the frozen
# liquid exceeds this. Rounding leaves some 1e-20; what is below is not felt even at resonance.
COUPLING_SHARE = 1e-10

_SAMPLES = np.linspace(0.0, 1.0, 1001)  # of half the surface, where the largest |psi| is sought


def section_coefficients(
    tank: UniformTank,
    depth: float,
    density: float,
    modes: int,
    resolution: Resolution = DEFAULT,
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    tank : UniformTank
        The tank.
    depth : float
        Depth of the liquid [m].
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes.
    resolution : Resolution
        Size of the discrete problem; the default gives five digits or more, but three of the
        wall friction in a nearly full tank.

    Raises
    ------
    InputError
        If the section is far from convex.
    """
    liquid = tank.filled(depth)
    half_width = tank.section.moments(depth).half_width
    half = half_section(tank.section, depth, resolution)
    shift = (np.pi / max(tank.length, 2.0 * half_width)) ** 2
    even = _Functions(half, np.ones_like(half.on_axis), shift)
    odd = _Functions(half, ~half.on_axis, shift)
    whole = np.array([liquid.volume, liquid.volume, np.inf, *np.diag(liquid.inertia)])

    found: list[_Mode] = []
    for a in itertools.chain([0], itertools.count(1, 2)):
        new = [
            mode
            for functions in ([even, odd] if a else [odd])
            for mode in _modes(half, functions, a, tank.length)
            if np.max(mode.coupling**2 / whole) > COUPLING_SHARE * mode.mu
        ]
        # the lowest frequency for this a rises with a
        if len(found) >= modes and min(mode.kappa for mode in new) > found[modes - 1].kappa:
            break
        found = sorted(found + new, key=lambda mode: mode.kappa)
    found = found[:modes]

    points = surface_grid(tank.length, 2.0 * half_width)
    across = half.surface(1.0 - np.abs(points[:, 1]) / half_width)
    side = np.sign(points[:, 1])
    return ModalCoefficients(
        route='section',
        density=density,
        liquid=liquid,
        names=tuple(mode_name(mode.a, mode.b) for mode in found),
        omega=np.sqrt(GRAVITY * np.array([mode.kappa for mode in found])),
        mu=density * np.array([mode.mu for mode in found]),
        coupling=density * np.array([mode.coupling for mode in found]),
        inertia_stokes_joukowski=density * _stokes_joukowski(tank, depth, half, even, odd),
        wall_friction=np.array([mode.wall_friction for mode in found]),
        surface_points=points,
        surface_shapes=np.stack(
            [
                np.cos(mode.a * np.pi * (points[:, 0] / tank.length + 0.5))
                * (across @ mode.psi[: across.shape[1]])
                * (side if mode.b % 2 else 1.0)
                for mode in found
            ],
            axis=-1,
        ),
        potentials=_Potentials(tank.length, half, even, odd, tuple(found)),
    )


class _Mode(NamedTuple):
    """A mode for unit density; psi is its coefficients among the functions."""

    a: int
    b: int
    kappa: float
    mu: float
    wall_friction: float
    coupling: Array
    psi: Array


class _Functions:
    """
    The functions even, or odd, in y, and on them the inverse of K + k^2 M for all k at once.

    With M X = (K + s M) X Theta and X^T (K + s M) X = 1, it is X (1 + (k^2 - s) Theta)^-1 X^T. The
    shift s > 0 is for the constant, which K maps to zero. The knots are so dense at the contact
    line that the smallest Theta have no digits; they hardly count. The other way round, in
    K X = M X Lambda, the largest Lambda would cost the smallest theirs.

    Parameters
    ----------
    half : HalfSection
        Half the section.
    among : array of bool, shape (n,)
        Which of its functions.
    shift : float
        The shift s, of the scale of the smallest k^2 or smaller [1/m^2].
    """

    def __init__(self, half: HalfSection, among: NDArray[np.bool_], shift: float) -> None:
        chosen = np.ix_(among, among)
        mass = half.mass[chosen]
        theta, vectors = eigh(mass, half.stiffness[chosen] + shift * mass)
        self.shift = shift
        self.theta: Array = np.maximum(theta, np.finfo(float).eps * theta[-1])
        self.vectors: Array = np.zeros((len(among), len(theta)))
        self.vectors[among] = vectors
        self.is_odd = not among.all()
        # S = C C^T on the free surface
        wet = among[: len(half.surface_one)]
        self._root: Array = self.vectors[: len(wet)][wet].T @ cholesky(
            half.surface_mass[np.ix_(wet, wet)], lower=True
        )

    @property
    def alpha(self) -> Array:
        """Roots of the Neumann eigenvalues of K X = alpha^2 M X; about 0 for the constant."""
        squared = 1.0 / self.theta - self.shift
        return np.sqrt(np.maximum(squared, np.finfo(float).tiny))

    def inverse(self, k: float) -> Array:
        """Return the diagonal D of (K + k^2 M)^-1 = X D X^T."""
        return 1.0 / (1.0 + (k**2 - self.shift) * self.theta)

    def steklov(self, k: float) -> tuple[Array, Array]:
        """Return kappa, rising, and psi by columns, with psi^T S psi = 1."""
        inverse = self.inverse(k)
        # C^T psi = kappa C^T (X D X^T) C (C^T psi)
        response, surface = eigh((self._root.T * inverse) @ self._root)
        kappa = 1.0 / response[::-1]
        weighted = inverse[:, np.newaxis] * (self._root @ surface[:, ::-1])
        return kappa, self.vectors @ weighted * kappa


def _modes(half: HalfSection, functions: _Functions, a: int, length: float) -> list[_Mode]:
    """All modes with `a` half-waves along the tank, and psi among the functions."""
    k = a * np.pi / length
    kappa, psi = functions.steklov(k)
    surface = psi[: len(half.surface_one)]
    # integrals over the half section and its surface: twice for the whole
    coupling = np.zeros((6, len(kappa)))
    if a == 0:
        coupling[1] = 2.0 * length * half.surface_y @ surface
        coupling[3] = 2.0 * length / kappa * (half.roll @ psi)
    elif functions.is_odd:
        coupling[5] = 4.0 / kappa * ((half.y - half.d_dy / k**2) @ psi)
    else:
        coupling[0] = -4.0 / k**2 * half.surface_one @ surface
        coupling[4] = 4.0 / kappa * ((half.d_dz / k**2 - half.z) @ psi)
    mu = (length if a else 2.0 * length) / kappa  # eq (10)

    # half the wall over the volume integral of |grad phi|^2: along the wall, and both ends; the
    # integrals of sin^2 and cos^2 kx, and psi^T S psi = 1 on half the surface
    sin2, cos2 = (length / 2.0, length / 2.0) if a else (0.0, length)
    along_wall = k**2 * sin2 * _energies(half.wall_mass, psi)
    along_wall += cos2 * _energies(half.wall_stiffness, psi)
    ends = 2.0 * _energies(half.stiffness, psi)
    friction = (along_wall + ends) / (2.0 * kappa * cos2)

    # f is positive at (-x, -y), hence psi at the contact line y > 0 if even, -psi if odd
    sign = np.where((surface[0] > 0.0) == functions.is_odd, -1.0, 1.0)
    scale = sign / _peaks(half.surface(_SAMPLES) @ surface)
    columns = zip(
        kappa, mu * scale**2, friction, (coupling * scale).T, (psi * scale).T, strict=True
    )
    return [_Mode(a, 2 * n + functions.is_odd, *column) for n, column in enumerate(columns)]


@dataclass(frozen=True, eq=False)
class _Potentials:
    """
    The potentials of modes, and of rotation about O under a closed lid.

    With the Neumann eigenpairs (N_m, alpha_m^2) of the closed section, the constant among them,
    and w_m = sinh(alpha_m x)/(alpha_m cosh(alpha_m L/2)),

        Omega_5 = -x z + 2 sum_m <z, N_m> N_m w_m,    Omega_6 = x y - 2 sum_m <y, N_m> N_m w_m,

    and Omega_4 is the plane Neumann problem of the section. All are odd in x or y, so that their
    means over the free surface are zero.
    """

    length: float
    half: HalfSection
    even: _Functions
    odd: _Functions
    found: tuple[_Mode, ...]

    def modes(self, points: Array) -> Array:
        x, y, _ = points.T
        parity = np.array([mode.b % 2 for mode in self.found], dtype=bool)
        k = np.pi / self.length * np.array([mode.a for mode in self.found])
        psi = self._functions(points) @ np.array([mode.psi for mode in self.found]).T
        across = np.where(parity, np.sign(y)[:, np.newaxis], 1.0) * psi
        return np.asarray(np.cos(np.outer(x + self.length / 2.0, k)) * across)

    def stokes_joukowski(self, points: Array) -> Array:
        x, y, z = points.T
        values, side = self._functions(points), np.sign(y)
        half, odd = self.half, self.odd
        roll = values @ odd.vectors @ (odd.inverse(0.0) * (half.roll @ odd.vectors))

        def along(functions: _Functions, arm: Array, slope: Array) -> Array:
            ends = sinh_ratio(functions.alpha, x[:, np.newaxis], self.length / 2.0)
            # <z, N> = <1, dN/dz>/alpha^2 by Green's identity: the smallest Theta have no digits
            products = slope @ functions.vectors * functions.inverse(0.0)
            if not functions.is_odd:  # but of the constant, the last
                products[-1] = arm @ functions.vectors[:, -1] / functions.theta[-1]
            return np.asarray(2.0 * np.sum(values @ functions.vectors * ends * products, axis=1))

        pitch = along(self.even, half.z, half.d_dz) - x * z
        yaw = x * y - side * along(odd, half.y, half.d_dy)
        return np.stack([side * roll, pitch, yaw], axis=-1)

    def _functions(self, points: Array) -> Array:
        return self.half.fan.values(np.stack([np.abs(points[:, 1]), points[:, 2]], axis=-1))


def _energies(form: Array, columns: Array) -> Array:
    """Value of a quadratic form for each column."""
    return np.asarray(np.einsum('ij,ij->j', form @ columns, columns))


def _peaks(samples: Array) -> Array:
    """Largest modulus in each column, refined by the parabola through the three samples there."""
    # beyond the ends the columns are mirrored: a peak at an end stays as it is
    modulus = np.pad(np.abs(samples), ((1, 1), (0, 0)), mode='reflect')
    top, column = modulus[1:-1].argmax(axis=0), np.arange(modulus.shape[1])
    before, peak, after = (modulus[top + i, column] for i in range(3))
    bend = np.maximum(2.0 * peak - before - after, np.finfo(float).tiny)
    refined: Array = peak + (after - before) ** 2 / (8.0 * bend)
    return refined


def _stokes_joukowski(
    tank: UniformTank, depth: float, half: HalfSection, even: _Functions, odd: _Functions
) -> Array:
    """Inertia of the liquid under a closed lid about O, for unit density [m^5]."""
    length, section = tank.length, tank.section.moments(depth)

    def across(functions: _Functions, arm: Array, second_moment: float) -> float:
        # The constant is among the Neumann pairs (N, alpha^2) here: 4 A zbar^2 L is its term.
        alpha = functions.alpha
        products = 2.0 * (arm @ functions.vectors) ** 2 / functions.theta
        ends = 8.0 * np.sum(products * np.tanh(alpha * length / 2.0) / alpha)
        return section.area * length**3 / 12.0 - 3.0 * length * second_moment + float(ends)

    roll = 2.0 * length * np.sum((half.roll @ odd.vectors) ** 2 * odd.inverse(0.0))
    return np.diag([roll, across(even, half.z, section.zz), across(odd, half.y, section.yy)])
