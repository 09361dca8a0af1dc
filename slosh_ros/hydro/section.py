"""
Tank of uniform section with flat ends (THEORY 4).

A mode is phi = cos k(x + L/2) psi(y, z) with k = a pi/L. In the section, psi obeys

    lap psi = k^2 psi,  dpsi/dn = 0 on the wall,  dpsi/dz = kappa psi on the free surface,

in weak form (K + k^2 M) psi = kappa S psi. Those with a = 0 couple with sway and roll, those with
a odd with surge, pitch and yaw, no others with the motion of the tank. K and M do not know k:
their eigenpairs serve every a. In a symmetric section psi is even or odd in y, two problems of
half the size.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import (
    Array,
    ModalCoefficients,
    mode_name,
    mode_numbers,
    peaks,
    still_coefficients,
    surface_grid,
)
from slosh_ros.hydro.hyperbolic import sinh_ratio
from slosh_ros.hydro.section_functions import Parity, SectionFunctions
from slosh_ros.hydro.section_mesh import Resolution, fitting, half_section
from slosh_ros.hydro.section_triangles import (
    DEFAULT_TRIANGLES,
    TriangleResolution,
    polygon_functions,
)
from slosh_ros.tank import Polygon, SectionMoments, SymmetricSection, UniformTank

# A mode couples if its share lambda^2/mu of the mass, or of a moment of inertia, of the frozen
# liquid exceeds this. Rounding leaves some 1e-20; what is below is not felt even at resonance.
COUPLING_SHARE = 1e-10

_SAMPLES = 1001  # of each piece of the surface, among which the largest |psi| is sought
_LEFTMOST_CREST = 0.5  # [max |f|] how high the crest at the left end stands that settles the sign
_WAVES = 1.5  # shortest wave that is resolved, per estimate
_FEWEST_WAVES = 4.0  # [half-waves across the surface], so that a few modes have a fine mesh, too


def section_coefficients(
    tank: UniformTank,
    depth: float,
    density: float,
    modes: int | Sequence[str],
    resolution: Resolution | TriangleResolution | None = None,
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency, or of those that are named.

    Parameters
    ----------
    tank : UniformTank
        The tank.
    depth : float
        Depth of the liquid [m]; a full tank has no modes.
    density : float
        Density of the liquid [kg/m^3].
    modes : int or sequence of str
        Number of modes, or their names: at any fill a name means the same mode.
    resolution : Resolution, or TriangleResolution for a polygon, optional
        Size of the discrete problem; the default gives five digits or more, but three of the
        wall friction in a nearly full tank and two at a corner that juts into the liquid. Ellipses
        more than five times as wide as high lose digits: at 8 and 90 % full, mu has three.

    Raises
    ------
    InputError
        If the liquid is not one pool, or the section too intricate or far from convex. So is a
        film over a shelf that is thousands of times as wide.
    """
    if depth == tank.height:
        return _full(tank, density, resolution)
    liquid, moments = tank.filled(depth), tank.section.moments(depth)
    shift = (np.pi / max(tank.length, moments.width)) ** 2
    families = [
        _Family(functions, moments, shift)
        for functions in _functions(tank, depth, modes, moments, resolution)
    ]
    whole = np.array([liquid.volume, liquid.volume, np.inf, *np.diag(liquid.inertia)])

    def those(a: int) -> list[_Mode]:
        return [
            mode
            for family in families
            if a or family.functions.parity != Parity.EVEN
            for mode in _modes(family, a, tank.length)
        ]

    found: list[_Mode] = []
    if isinstance(modes, int):
        for a in itertools.chain([0], itertools.count(1, 2)):
            new = [
                mode
                for mode in those(a)
                if np.max(mode.coupling**2 / whole) > COUPLING_SHARE * mode.mu
            ]
            # the lowest frequency for this a rises with a
            if len(found) >= modes and min(mode.kappa for mode in new) > found[modes - 1].kappa:
                break
            found = sorted(found + new, key=lambda mode: mode.kappa)
        found = found[:modes]
    else:
        along = {mode_numbers(name)[0] for name in modes}
        by_name = {mode_name(m.a, m.b): m for a in sorted(along) for m in those(a)}
        found = [by_name[name] for name in modes]

    found = [_scaled(mode) for mode in found]
    potentials = _Potentials(tank.length, moments, tuple(families), tuple(found))
    points = np.concatenate(
        [
            surface_grid(tank.length, right - left) + np.array([0.0, (left + right) / 2.0])
            for left, right in moments.surface
        ]
    )
    return ModalCoefficients(
        route='section',
        density=density,
        liquid=liquid,
        names=tuple(mode_name(mode.a, mode.b) for mode in found),
        omega=np.sqrt(GRAVITY * np.array([mode.kappa for mode in found])),
        mu=density * np.array([mode.mu for mode in found]),
        coupling=density * np.array([mode.coupling for mode in found]),
        inertia_stokes_joukowski=density * _stokes_joukowski(tank.length, moments, families),
        wall_friction=np.array([_wall_friction(mode, tank.length) for mode in found]),
        surface_points=points,
        surface_shapes=potentials.surface(points),
        surface_gaps=tuple(
            (left[1], right[0]) for left, right in itertools.pairwise(moments.surface)
        ),
        potentials=potentials,
        crests=np.array(
            [
                np.stack([_on_surface(mode.family.samples[i], mode) for mode in found], axis=-1)
                for i in range(len(moments.surface))
            ]
        ),
    )


def _full(
    tank: UniformTank, density: float, resolution: Resolution | TriangleResolution | None
) -> ModalCoefficients:
    """Coefficients of a tank that is full: without modes, about O, the top of the tank."""
    section, depth, length = tank.section, tank.height, tank.length
    moments = section.moments(depth)
    if isinstance(section, Polygon):
        functions = _functions(tank, depth, 1, moments, resolution)
        middle = np.zeros(3)
    else:
        # the functions of the lower half, and of its mirror image, about the middle
        assert isinstance(section, SymmetricSection)
        assert not isinstance(resolution, TriangleResolution)
        half = section.moments(depth / 2.0)
        chosen = resolution or fitting(section, depth / 2.0, np.pi / length)
        functions = half_section(section, depth / 2.0, chosen).mirrored()
        moments = SectionMoments(2.0 * half.area, 0.0, 2.0 * half.yy, 2.0 * half.zz, ())
        middle = np.array([0.0, 0.0, -depth / 2.0])
    shift = (np.pi / max(length, *section.bounding_box)) ** 2
    families = tuple(_Family(f, moments, shift) for f in functions)
    liquid = tank.filled(depth)
    # the mass centre is the middle
    across = liquid.volume * (middle @ middle * np.eye(3) - np.outer(middle, middle))
    inertia = _stokes_joukowski(length, moments, families) + across
    potentials = _Closed(_Potentials(length, moments, families, ()), middle)
    return still_coefficients('section', density, liquid, density * inertia, potentials)


def _functions(
    tank: UniformTank,
    depth: float,
    modes: int | Sequence[str],
    moments: SectionMoments,
    resolution: Resolution | TriangleResolution | None,
) -> Sequence[SectionFunctions]:
    """Discretise the section: splines on half of a smooth one, triangles in a polygon."""
    section = tank.section
    width = moments.width or section.bounding_box[0]  # a full section has no surface
    across = max(_WAVES * half_waves(modes, tank.length, width), _FEWEST_WAVES)
    waves = np.pi / tank.length, np.pi / width * across
    if isinstance(section, Polygon):
        assert not isinstance(resolution, Resolution)
        return polygon_functions(section, depth, waves, resolution or DEFAULT_TRIANGLES)
    assert isinstance(section, SymmetricSection)
    assert not isinstance(resolution, TriangleResolution)
    half = half_section(section, depth, resolution or fitting(section, depth, waves[1]))
    return [half.whole(parity) for parity in (Parity.EVEN, Parity.ODD)]


def half_waves(modes: int | Sequence[str], length: float, width: float) -> float:
    """
    Half-waves across the surface in the lowest coupling modes, as they are counted on a rectangle.

    Of the pairs (a, b), half-waves along and across, inside a quarter of an ellipse with the half
    axes n L/W and n, those couple that are odd or zero: n (1 + L/W)/2 on the axes and
    pi/16 n^2 L/W between. Modes that are named tell theirs.
    """
    ratio = length / width
    if not isinstance(modes, int):
        return float(max(np.hypot(a / ratio, b) for a, b in map(mode_numbers, modes)))
    on_axes, between = (1.0 + ratio) / 2.0, np.pi / 16.0 * ratio
    return float(2.0 * modes / (on_axes + np.sqrt(on_axes**2 + 4.0 * between * modes)))


class _Mode(NamedTuple):
    """A mode for unit density; psi is its coefficients among the functions of its family."""

    family: _Family
    a: int
    b: int
    kappa: float
    mu: float
    coupling: Array
    psi: Array


class _Family:
    """
    Functions on the section, and on them the inverse of K + k^2 M for all k at once.

    With M X = (K + s M) X Theta and X^T (K + s M) X = 1, it is X (1 + (k^2 - s) Theta)^-1 X^T. The
    shift s > 0 is for the constant, which K maps to zero: the last of X, unless all are odd. Knots
    and corners are so dense at the contact line that the smallest Theta have no digits; they
    hardly count. The other way round, in K X = M X Lambda, the largest Lambda would cost the
    smallest theirs.

    Parameters
    ----------
    functions : SectionFunctions
        The functions.
    moments : SectionMoments
        Of the liquid.
    shift : float
        The shift s, of the scale of the smallest k^2 or smaller [1/m^2].
    """

    def __init__(self, functions: SectionFunctions, moments: SectionMoments, shift: float) -> None:
        self.functions = functions
        self.shift = shift
        theta, self.vectors = eigh(functions.mass, functions.stiffness + shift * functions.mass)
        self.theta: Array = np.maximum(theta, np.finfo(float).eps * theta[-1])
        self._moments = moments
        self._root: Array = self.vectors.T @ functions.surface_root

    @cached_property
    def samples(self) -> list[Array]:
        """The functions on the free surface, piece by piece from the left."""
        return [
            self.functions.at_surface(_dense_at_ends(left, right))
            for left, right in self._moments.surface
        ]

    @property
    def alpha(self) -> Array:
        """Roots of the Neumann eigenvalues of K X = alpha^2 M X; about 0 for the constant."""
        squared = 1.0 / self.theta - self.shift
        return np.sqrt(np.maximum(squared, np.finfo(float).tiny))

    def inverse(self, k: float) -> Array:
        """Return the diagonal D of (K + k^2 M)^-1 = X D X^T; for k = 0, 0 for the constant."""
        if k > 0.0 or not self.functions.has_constant:
            return 1.0 / (1.0 + (k**2 - self.shift) * self.theta)
        return np.append(1.0 / (1.0 - self.shift * self.theta[:-1]), 0.0)

    def steklov(self, k: float) -> tuple[Array, Array]:
        """
        Return kappa, rising, and psi by columns, with psi^T S psi = 1.

        For k = 0 the constant, kappa = 0, is left out.
        """
        inverse = self.inverse(k)
        # with S = C C^T: C^T psi = kappa C^T (X D X^T) C (C^T psi)
        response = (self._root.T * inverse) @ self._root
        level = np.zeros(len(response))
        if k == 0.0 and self.functions.has_constant:
            # the others have no mean over the surface: what of it comes in goes to the constant
            level = self._root[-1] / np.linalg.norm(self._root[-1])
            response -= np.outer(level, level @ response)
            response -= np.outer(response @ level, level)
        values, surface = eigh(response)
        good = np.flatnonzero(values > np.finfo(float).eps * values[-1])[::-1]
        kappa = 1.0 / values[good]
        weighted = inverse[:, np.newaxis] * (self._root @ surface[:, good])
        if level.any():
            weighted[-1] = -(level @ self._root.T @ weighted) / np.linalg.norm(self._root[-1])
        return kappa, self.vectors @ weighted * kappa


def _modes(family: _Family, a: int, length: float) -> list[_Mode]:
    """All modes with `a` half-waves along the tank, scaled as they are solved for."""
    k, f = a * np.pi / length, family.functions
    kappa, psi = family.steklov(k)
    coupling = np.zeros((6, len(kappa)))
    if a == 0:
        coupling[1] = length * f.surface_y @ psi
        coupling[3] = length / kappa * (f.roll @ psi)
    else:
        coupling[0] = -2.0 / k**2 * f.surface_one @ psi
        coupling[4] = 2.0 / kappa * ((f.d_dz / k**2 - f.z) @ psi)
        coupling[5] = 2.0 / kappa * ((f.y - f.d_dy / k**2) @ psi)
    mu = _squares(a, length)[1] / kappa  # eq (10)
    step = 1 if f.parity == Parity.NONE else 2
    first = int(f.parity == Parity.ODD) + step * (a == 0 and f.has_constant)
    columns = zip(kappa, mu, coupling.T, psi.T, strict=True)
    return [_Mode(family, a, first + step * n, *column) for n, column in enumerate(columns)]


def _squares(a: int, length: float) -> tuple[float, float]:
    """Integrals of sin^2 and cos^2 kx along the tank."""
    return (length / 2.0, length / 2.0) if a else (0.0, length)


def _wall_friction(mode: _Mode, length: float) -> float:
    """Half the wall's integral of |grad phi|^2 over the volume's [1/m]."""
    f, psi, kappa, k = mode.family.functions, mode.psi, mode.kappa, mode.a * np.pi / length
    sin2, cos2 = _squares(mode.a, length)
    # along the wall, and both ends
    along_wall = k**2 * sin2 * (psi @ f.wall_mass @ psi) + cos2 * (psi @ f.wall_stiffness @ psi)
    ends = 2.0 * (psi @ f.stiffness @ psi)
    return float((along_wall + ends) / (2.0 * kappa**2 * mode.mu))


def _scaled(mode: _Mode) -> _Mode:
    """Scale a mode to max |f| = 1, the leftmost crest or trough a crest."""
    pieces = [_on_surface(samples, mode) for samples in mode.family.samples]
    highest = max(peaks(piece[:, np.newaxis])[0] for piece in pieces)
    scale = _sign(np.concatenate(pieces)) / highest
    return mode._replace(
        mu=mode.mu * scale**2,
        coupling=mode.coupling * scale,
        psi=mode.psi * scale,
    )


@dataclass(frozen=True, eq=False)
class _Potentials:
    """
    The potentials of modes, and of rotation about O under a closed lid.

    With the Neumann eigenpairs (N_m, alpha_m^2) of the closed section, the constant among them,
    and w_m = sinh(alpha_m x)/(alpha_m cosh(alpha_m L/2)),

        Omega_5 = -x z + 2 sum_m <z, N_m> N_m w_m,    Omega_6 = x y - 2 sum_m <y, N_m> N_m w_m,

    and Omega_4 is the plane Neumann problem of the section, less its mean over the free surface;
    the others are odd in x.
    """

    length: float
    moments: SectionMoments
    families: tuple[_Family, ...]
    found: tuple[_Mode, ...]

    def modes(self, points: Array) -> Array:
        """Potentials phi_j of the modes, shape (p, n) [-]."""
        values = {family: family.functions.at(points[:, 1:]) for family in self.families}
        psi = [values[mode.family] @ mode.psi for mode in self.found]
        return self._along(points, psi)

    def surface(self, points: Array) -> Array:
        """Shapes f_j of the modes at points x, y of the free surface, shape (p, n) [-]."""
        y, which = np.unique(points[:, 1], return_inverse=True)
        values = {family: family.functions.at_surface(y) for family in self.families}
        return self._along(
            points, [_on_surface(values[mode.family], mode)[which] for mode in self.found]
        )

    def _along(self, points: Array, psi: Sequence[Array]) -> Array:
        """Waves along the tank, of what each mode is across it at the points."""
        k = np.pi / self.length * np.array([mode.a for mode in self.found])
        along = np.cos(np.outer(points[:, 0] + self.length / 2.0, k))
        return along * np.reshape(psi, along.T.shape).T

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        x, y, z = points.T
        omega = np.stack([0.0 * x, -x * z, x * y], axis=-1)
        for family in self.families:
            f = family.functions
            values = f.at(points[:, 1:]) @ family.vectors
            still = family.inverse(0.0)
            turning = still * (f.roll @ family.vectors)
            omega[:, 0] += values @ turning
            if self.moments.width:
                omega[:, 0] -= f.surface_one @ family.vectors @ turning / self.moments.width
            ends = sinh_ratio(family.alpha, x[:, np.newaxis], self.length / 2.0)
            for axis, arm, slope in ((1, f.z, f.d_dz), (2, -f.y, -f.d_dy)):
                # <z, N> = <1, dN/dz>/alpha^2 by Green: the smallest Theta have no digits
                products = slope @ family.vectors * still
                if f.has_constant:  # but of the constant, the last
                    products[-1] = arm @ family.vectors[:, -1] / family.theta[-1]
                omega[:, axis] += 2.0 * np.sum(values * ends * products, axis=1)
        return omega


@dataclass(frozen=True, eq=False)
class _Closed:
    """
    Potentials about O, the top of a full tank, from those about a point P.

    As P moves by r_P, Omega changes by -r_P x r (THEORY 2.4).

    Attributes
    ----------
    about : _Potentials
        About P.
    place : array, shape (3,)
        P, from O [m].
    """

    about: _Potentials
    place: Array

    def modes(self, points: Array) -> Array:
        """There are none, shape (p, 0)."""
        return np.zeros((len(points), 0))

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        omega = self.about.stokes_joukowski(points - self.place)
        if not self.about.moments.width:  # no roof over which their mean is zero: zero at O
            omega = omega - self.about.stokes_joukowski(-self.place[np.newaxis])
        return np.asarray(omega + np.cross(self.place, points))


def _dense_at_ends(left: float, right: float) -> Array:
    """
    Places on an interval among which crests are sought, shape (p,).

    Just above a corner of the wall the highest wave may be as near to the end as the corner is.
    In the angle of which the places are cosines, waves bend smoothly and are even about both ends.
    """
    angle = np.linspace(0.0, np.pi, _SAMPLES)
    places = (left + right) / 2.0 - (right - left) / 2.0 * np.cos(angle)
    places[-1] = right  # without rounding
    return np.asarray(places)


def _on_surface(samples: Array, mode: _Mode) -> Array:
    """Shape of a mode, of values of its family's functions on the free surface."""
    return np.asarray(samples @ mode.psi[: samples.shape[1]])


def _sign(samples: Array) -> float:
    """Sign that makes the leftmost crest or trough a crest."""
    modulus = np.abs(samples)
    return float(np.sign(samples[np.argmax(modulus >= _LEFTMOST_CREST * modulus.max())]))


def _stokes_joukowski(
    length: float, moments: SectionMoments, families: Sequence[_Family]
) -> Array:
    """
    Inertia of the liquid under a closed lid about O, for unit density [m^5].

    Of the potentials -x u + ... of pitch and yaw, with u = z and u = -y, it is

        A L^3/12 - 3 L <u_i, u_k> + 8 sum_m <u_i, N_m> <u_k, N_m> tanh(alpha_m L/2)/alpha_m,

    the first for i = k only. Roll is uniform along x and they are odd: none of it is in both.
    """
    m = moments
    inertia = np.zeros((3, 3))
    inertia[1:, 1:] = m.area * length**3 / 12.0 * np.eye(2) - 3.0 * length * np.array(
        [[m.zz, -m.yz], [-m.yz, m.yy]]
    )
    for family in families:
        f, alpha = family.functions, family.alpha
        turning = f.roll @ family.vectors
        inertia[0, 0] += length * turning**2 @ family.inverse(0.0)
        arms = np.stack([f.z, -f.y]) @ family.vectors
        inertia[1:, 1:] += (
            8.0 * (arms * np.tanh(alpha * length / 2.0) / (alpha * family.theta)) @ arms.T
        )
    return inertia
