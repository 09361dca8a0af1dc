"""
Splines on half a section: the functions among which its eigenproblem is solved.

The liquid's half y > 0 is the image of the unit square under

    P(rho, t) = sum_k B_k(t) ray_k(rho),    B_k the cubic Bernstein polynomials,

a fan of four rays from the contact line C (rho = 0) to the symmetry plane (rho = 1). The first is
the free surface, the last the wall; the two between are straight and bend the fan into polar
coordinates around C, smooth even where surface and wall meet at nearly 180 degrees. Functions are
products of a spline in rho and a polynomial in t. The solution is singular at C, as a power of the
distance; that is along rho, and there the knots are dense.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import cholesky
from scipy.spatial import cKDTree

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.section_functions import Parity, SectionFunctions
from slosh_ros.tank import SymmetricSection

# Below O, the straight rays end at so many half widths of the free surface, the scale on which
# modes decay downwards, but not below these shares of the depth.
_RAY_HALF_WIDTHS = np.array([0.0, 0.5, 2.0])
_RAY_DEPTHS = np.array([0.0, 1.0, 2.0]) / 3.0

_UNIT = np.array([0.0, 1.0])

# Where a point is looked for in the fan, before Newton's method; dense at the contact line
_SEEK_RHO, _SEEK_T = np.linspace(0.0, 1.0, 65)[1:] ** 2, np.linspace(0.0, 1.0, 17)
_SEEK_STEPS = 50  # some 5 do; a point beyond the wall slides along it
_AT_REST = 1e-13  # step that changes nothing
_FOUND = 1e-5  # [half widths of the surface] that a point may lie outside, for rounding


@dataclass(frozen=True)
class Resolution:
    """
    Size of the discrete problem, of about `spans` times `fan_degree` unknowns.

    Attributes
    ----------
    spans : int
        Knot spans of the splines in rho.
    degree : int
        Degree of these splines.
    fan_degree : int
        Degree of the polynomials in t.
    """

    spans: int = 20
    degree: int = 6
    fan_degree: int = 14


DEFAULT = Resolution()


@dataclass(frozen=True, eq=False)
class HalfSection:
    """
    Integrals of the functions v over the half y > 0 of the liquid in a section.

    The first m of the n functions are those of the free surface; the others vanish there.

    Attributes
    ----------
    stiffness, mass : array, shape (n, n)
        Integrals over the area of grad v_i . grad v_j and of v_i v_j.
    d_dy, d_dz, y, z, roll : array, shape (n,)
        Integrals over the area of dv/dy, dv/dz, y v, z v and y dv/dz - z dv/dy.
    wall_mass, wall_stiffness : array, shape (n, n)
        Integrals over the wall of v_i v_j and of their derivatives along it.
    surface_mass : array, shape (m, m)
        Integrals over the free surface of v_i v_j.
    surface_one, surface_y : array, shape (m,)
        Integrals over the free surface of v and y v.
    surface : BSpline
        The functions of the free surface, of rho = 1 - y/half_width.
    on_axis : array of bool, shape (n,)
        Which functions do not vanish on the symmetry plane.
    fan : Fan
        The functions at single points.
    """

    stiffness: Array
    mass: Array
    d_dy: Array
    d_dz: Array
    y: Array
    z: Array
    roll: Array
    wall_mass: Array
    wall_stiffness: Array
    surface_mass: Array
    surface_one: Array
    surface_y: Array
    surface: BSpline
    on_axis: NDArray[np.bool_]
    fan: Fan

    def whole(self, parity: Parity) -> SectionFunctions:
        """Continue the functions evenly or oddly to y < 0: integrals over the whole section."""
        is_odd = parity == Parity.ODD
        among = ~self.on_axis if is_odd else np.ones_like(self.on_axis)
        at_surface = among[: len(self.surface_one)]
        root = np.zeros((np.count_nonzero(among), np.count_nonzero(at_surface)))
        root[: root.shape[1]] = cholesky(
            2.0 * self.surface_mass[np.ix_(at_surface, at_surface)], lower=True
        )
        half_width = float(self.fan.net[0, 0, 0])

        def matrix(half: Array) -> Array:
            return 2.0 * half[np.ix_(among, among)]

        def vector(half: Array, half_is_odd: bool) -> Array:
            # the functions of the free surface come first
            full = np.pad(half, (0, len(among) - len(half)))
            return 2.0 * full[among] * (is_odd == half_is_odd)

        def mirrored(values: Array, y: Array) -> Array:
            return values * np.sign(y)[:, np.newaxis] if is_odd else values

        def on_surface(y: Array) -> Array:
            values = np.zeros((len(y), len(among)))
            values[:, : len(at_surface)] = self.surface(1.0 - np.abs(y) / half_width)
            return mirrored(values[:, among], y)

        def anywhere(points: Array) -> Array:
            half = np.stack([np.abs(points[:, 0]), points[:, 1]], axis=-1)
            return mirrored(self.fan.values(half)[:, among], points[:, 0])

        return SectionFunctions(
            parity=parity,
            has_constant=not is_odd,
            stiffness=matrix(self.stiffness),
            mass=matrix(self.mass),
            d_dy=vector(self.d_dy, True),
            d_dz=vector(self.d_dz, False),
            y=vector(self.y, True),
            z=vector(self.z, False),
            roll=vector(self.roll, True),
            wall_mass=matrix(self.wall_mass),
            wall_stiffness=matrix(self.wall_stiffness),
            surface_root=root,
            surface_one=vector(self.surface_one, False),
            surface_y=vector(self.surface_y, True),
            at_surface=on_surface,
            at=anywhere,
        )

    def mirrored(self) -> tuple[SectionFunctions, ...]:
        """
        Continue the functions to the mirror image above the surface, which is then no surface.

        They are about the middle of the whole, even or odd both in y and in z. Those that are
        even in both take no part in any rotation, and are left out.
        """
        return (
            _upwards(self.whole(Parity.EVEN), True),
            _upwards(self.whole(Parity.ODD), False),
            _upwards(self.whole(Parity.ODD), True),
        )


def _upwards(f: SectionFunctions, is_odd: bool) -> SectionFunctions:
    """Continue functions oddly or evenly to z > 0: integrals over both halves."""
    count, at_surface = f.surface_root.shape  # those of the surface come first
    among = slice(at_surface if is_odd else 0, None)

    def matrix(half: Array) -> Array:
        return 2.0 * half[among, among]

    def vector(half: Array, half_is_odd: bool) -> Array:
        return 2.0 * half[among] * (is_odd == half_is_odd)

    def anywhere(points: Array) -> Array:
        values = f.at(np.stack([points[:, 0], -np.abs(points[:, 1])], axis=-1))[:, among]
        return values * np.where(points[:, 1:] > 0.0, -1.0, 1.0) if is_odd else values

    nothing = np.zeros(len(range(count)[among]))
    return SectionFunctions(
        parity=f.parity,
        has_constant=f.has_constant and not is_odd,
        stiffness=matrix(f.stiffness),
        mass=matrix(f.mass),
        d_dy=vector(f.d_dy, False),
        d_dz=vector(f.d_dz, True),
        y=vector(f.y, False),
        z=vector(f.z, True),
        roll=vector(f.roll, True),
        wall_mass=matrix(f.wall_mass),
        wall_stiffness=matrix(f.wall_stiffness),
        surface_root=np.zeros((len(nothing), 0)),
        surface_one=nothing,
        surface_y=nothing,
        at_surface=lambda y: np.zeros((len(y), len(nothing))),
        at=anywhere,
    )


@dataclass(frozen=True, eq=False)
class Fan:
    """
    The map P and the functions on it.

    Attributes
    ----------
    net : array, shape (4, 2, m)
        Spline coefficients of the rays.
    along, across : BSpline
        The functions of rho and of t that make up the products.
    """

    net: Array
    along: BSpline
    across: BSpline

    def values(self, points: Array) -> Array:
        """
        Values of the functions at points of the half section.

        Parameters
        ----------
        points : array, shape (p, 2)
            y >= 0 and z about O [m], within the liquid.

        Returns
        -------
        array, shape (p, n)
            The values.

        Raises
        ------
        InputError
            If a point is not in the liquid.
        """
        rho, t = self._found(points)
        return _joined(self.along(rho)[:, :, np.newaxis] * self.across(t)[:, np.newaxis])

    def _found(self, points: Array) -> tuple[Array, Array]:
        """Places rho and t of points: Newton's method from the nearest of some known ones."""
        rho, t = (grid.ravel() for grid in np.meshgrid(_SEEK_RHO, _SEEK_T))
        nearest = cKDTree(self._at(rho, t).T).query(points)[1]
        rho, t = rho[nearest], t[nearest]
        for _ in range(_SEEK_STEPS):
            (y_rho, z_rho), (y_t, z_t) = self._at(rho, t, 1, 0), self._at(rho, t, 0, 1)
            y, z = points.T - self._at(rho, t)
            # at rho = 0, the contact line, any t will do
            jacobian = np.maximum(y_rho * z_t - z_rho * y_t, np.finfo(float).tiny)
            last = np.stack([rho, t])
            rho = np.clip(rho + (z_t * y - y_t * z) / jacobian, 0.0, 1.0)
            t = np.clip(t + (y_rho * z - z_rho * y) / jacobian, 0.0, 1.0)
            if np.abs(last - [rho, t]).max() < _AT_REST:
                break
        far = np.hypot(*(points.T - self._at(rho, t))) > _FOUND * self.net[0, 0, 0]
        if far.any():
            y, z = points[far][0]
            raise InputError(f'the section has no liquid at y = {y:g} m, z = {z:g} m from O')
        return rho, t

    def _at(self, rho: Array, t: Array, i: int = 0, j: int = 0) -> Array:
        """Return P differentiated by rho, i times, and by t, j times, shape (2, p)."""
        rays = np.tensordot(self.net, self.along(rho, i), axes=([2], [1]))
        blend = _splines(_UNIT, len(self.net) - 1)(t, j)
        return np.asarray(np.einsum('kdp,pk->dp', rays, blend))


def half_section(
    section: SymmetricSection, depth: float, resolution: Resolution = DEFAULT
) -> HalfSection:
    """
    Functions on half of the liquid in a section.

    Parameters
    ----------
    section : Section
        The section.
    depth : float
        Depth of the liquid [m].
    resolution : Resolution
        Number and degree of the functions.

    Raises
    ------
    InputError
        If the fan of rays folds over, as it may in a section far from convex.
    """
    corners = np.array(section.corners(depth))
    breaks = _breaks(corners, resolution.spans)
    along = _splines(breaks, resolution.degree, corners)
    across = _splines(_UNIT, resolution.fan_degree)
    net = _control_net(section, depth, along)
    blend = _splines(_UNIT, len(net) - 1)
    rho, rho_weight = _gauss(breaks, resolution.degree)
    t, t_weight = _gauss(_UNIT, resolution.fan_degree + 2)

    # the map P and the functions, each with its derivatives by rho and by t
    orders = ((0, 0), (1, 0), (0, 1))
    (y, z), (y_rho, z_rho), (y_t, z_t) = (
        np.einsum('kdi,ri,tk->drt', net, along(rho, i), blend(t, j)).reshape(2, -1, 1)
        for i, j in orders
    )
    v, v_rho, v_t = (_products(along(rho, i), across(t, j)) for i, j in orders)
    jacobian = y_rho * z_t - z_rho * y_t
    if jacobian.min() <= 0.0:
        raise InputError(
            'the wall of the section turns back under or over the free surface; '
            'only sections that are convex, or nearly so, can be computed'
        )
    v_y = (z_t * v_rho - z_rho * v_t) / jacobian
    v_z = (y_rho * v_t - y_t * v_rho) / jacobian

    weight = np.outer(rho_weight, t_weight).reshape(-1, 1) * jacobian
    root = np.sqrt(weight)
    half_width = float(net[0, 0, 0])
    s, s_weight = along(rho), half_width * rho_weight
    at_wall, along_wall = (_products(along(rho, i), across(_UNIT[1:])) for i in (0, 1))
    # arc length per rho, on the last ray
    speed = np.hypot(*np.einsum('di,ri->dr', net[-1], along(rho, 1)))
    m, n = s.shape[1], v.shape[1]
    return HalfSection(
        stiffness=_gram(root * v_y) + _gram(root * v_z),
        mass=_gram(root * v),
        d_dy=np.sum(weight * v_y, axis=0),
        d_dz=np.sum(weight * v_z, axis=0),
        y=np.sum(weight * y * v, axis=0),
        z=np.sum(weight * z * v, axis=0),
        roll=np.sum(weight * (y * v_z - z * v_y), axis=0),
        wall_mass=_gram(np.sqrt(rho_weight * speed)[:, np.newaxis] * at_wall),
        wall_stiffness=_gram(np.sqrt(rho_weight / speed)[:, np.newaxis] * along_wall),
        surface_mass=_gram(np.sqrt(s_weight)[:, np.newaxis] * s),
        surface_one=s_weight @ s,
        surface_y=(s_weight * half_width * (1.0 - rho)) @ s,
        surface=along,
        on_axis=(np.arange(n) == m - 1) | (np.arange(n) >= n - resolution.fan_degree),
        fan=Fan(net, along, across),
    )


def _breaks(corners: Array, spans: int) -> Array:
    """Knots on [0, 1], dense at 0; one that is close to a corner gives way to it."""
    graded = np.linspace(0.0, 1.0, spans + 1) ** 2
    distance = np.abs(np.subtract.outer(graded, corners)).min(axis=1, initial=np.inf)
    free = distance > np.gradient(graded) / 3.0
    free[[0, -1]] = True
    return np.unique(np.concatenate([graded[free], corners]))


def _splines(breaks: Array, degree: int, corners: Array = _UNIT[:0]) -> BSpline:
    """All B-splines on these breaks, smooth except for a kink at each corner."""
    ends = np.repeat(breaks[[0, -1]], degree)
    knots = np.sort(np.concatenate([breaks, ends, np.repeat(corners, degree - 1)]))
    return BSpline(knots, np.eye(len(knots) - degree - 1), degree)


def _control_net(section: SymmetricSection, depth: float, along: BSpline) -> Array:
    """Spline coefficients of the rays, shape (4, 2, m): surface, two straight ones, wall."""
    # the Greville points: the coefficients of the spline that equals rho
    rho = sliding_window_view(along.t[1:-1], along.k).mean(axis=1).clip(0.0, 1.0)
    wall = make_interp_spline(rho, section.wall(depth, rho), along.k, along.t, axis=1)
    half_width = section.moments(depth).half_width
    ends = np.minimum(half_width * _RAY_HALF_WIDTHS, depth * _RAY_DEPTHS)
    straight = [np.stack([half_width * (1.0 - rho), -end * rho]) for end in ends]
    return np.stack([*straight, wall.c.T])


def _gauss(breaks: Array, order: int) -> tuple[Array, Array]:
    """Gauss points and weights, `order` of them between each two breaks."""
    x, weight = np.polynomial.legendre.leggauss(order)
    half = np.diff(breaks)[:, np.newaxis] / 2.0
    return (breaks[:-1, np.newaxis] + half * (1.0 + x)).ravel(), (half * weight).ravel()


def _products(along: Array, across: Array) -> Array:
    """Products of functions of rho, shape (r, m), and of t, shape (q, f), at all r q points."""
    product = np.einsum('ri,qj->rqij', along, across)
    return _joined(product.reshape(-1, *product.shape[2:]))


def _joined(product: Array) -> Array:
    """Functions that are continuous, of products at p points, shape (p, m, f)."""
    # rho = 0 is one point, whatever t: there the f products make up one function
    contact = product[:, 0].sum(axis=1, keepdims=True)
    return np.hstack([contact, product[:, 1:, 0], product[:, 1:, 1:].reshape(len(product), -1)])


def _gram(columns: Array) -> Array:
    """Scalar products of all columns with one another."""
    return columns.T @ columns
