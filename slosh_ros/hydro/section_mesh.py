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

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

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
_WAVES = 12.0  # half-waves across the surface that it serves
_MORE_SPANS, _MORE_DEGREES = 1.0, 0.4  # for each half-wave more
# Under a roof that is much wider than the liquid is deep, the fan is bent sharply.
_FLAT, _FLAT_DEGREES = 1.5, 8.0
_MOST_SPANS, _MOST_DEGREE = 60, 22  # Bernstein polynomials of higher degree lose their digits


def fitting(section: SymmetricSection, depth: float, wave_number: float) -> Resolution:
    """
    Resolution that gives waves up to a wave number [1/m] five digits.

    Parameters
    ----------
    section : Section
        The section.
    depth : float
        Depth of the liquid [m].
    wave_number : float
        Largest of interest [1/m].
    """
    half_width = section.moments(depth).half_width
    reach = float(section.wall(depth, np.linspace(0.0, 1.0, 65))[0].max())
    flat = max(reach / depth - _FLAT, 0.0) if reach > half_width * (1.0 + _FOUND) else 0.0
    more = max(2.0 * wave_number * half_width / np.pi - _WAVES, 0.0)
    degree = DEFAULT.fan_degree + max(_FLAT_DEGREES * flat, _MORE_DEGREES * more)
    return Resolution(
        spans=min(DEFAULT.spans + int(_MORE_SPANS * more), _MOST_SPANS),
        degree=DEFAULT.degree,
        fan_degree=min(int(degree), _MOST_DEGREE),
    )


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
        half_width = self.fan.radius

        def matrix(half: Array) -> Array:
            return 2.0 * half[np.ix_(among, among)]

        def vector(half: Array, half_is_odd: bool) -> Array:
            # the functions of the free surface come first
            full = np.pad(half, (0, len(among) - len(half)))
            return 2.0 * full[among] * (is_odd == half_is_odd)

        def mirrored(values: Array, y: Array) -> Array:
            return values * np.sign(y)[:, np.newaxis] if is_odd else values

        def on_surface(y: Array) -> Array:
            return mirrored(self.surface(1.0 - np.abs(y) / half_width)[:, at_surface], y)

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
        at_surface=lambda y: np.zeros((len(y), 0)),
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

    @property
    def radius(self) -> float:
        """Half the width of the free surface [m]."""
        return float(self.net[0, 0, 0])

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
        far = np.hypot(*(points.T - self._at(rho, t))) > _FOUND * self.radius
        if far.any():
            y, z = points[far][0]
            raise InputError(f'the section has no liquid at y = {y:g} m, z = {z:g} m from O')
        return rho, t

    def _at(self, rho: Array, t: Array, i: int = 0, j: int = 0) -> Array:
        """Return P differentiated by rho, i times, and by t, j times, shape (2, p)."""
        rays = np.tensordot(self.net, self.along(rho, i), axes=([2], [1]))
        blend = _splines(_UNIT, len(self.net) - 1)(t, j)
        return np.asarray(np.einsum('kdp,pk->dp', rays, blend))


class Samples(NamedTuple):
    """
    The functions v that do not vanish on one span of knots, at Gauss points of it.

    Attributes
    ----------
    which : array of int, shape (n,)
        Their numbers among all.
    y, z : array, shape (p,)
        Points of the area about O [m].
    weight : array, shape (p,)
        Of the integral over the area [m^2].
    v, v_y, v_z : array, shape (p, n)
        The functions and their derivatives there.
    wall_y, wall_weight : array, shape (q,)
        Distance from the symmetry plane of points of the wall [m], and weight of the integral
        along it [m].
    wall, along_wall : array, shape (q, n)
        The functions and their derivatives along the wall there.
    surface_y, surface_weight : array, shape (q,)
        Points of the free surface [m] and weight of the integral over it [m].
    surface : array, shape (q, n)
        The functions there.
    """

    which: NDArray[np.intp]
    y: Array
    z: Array
    weight: Array
    v: Array
    v_y: Array
    v_z: Array
    wall_y: Array
    wall_weight: Array
    wall: Array
    along_wall: Array
    surface_y: Array
    surface_weight: Array
    surface: Array


@dataclass(frozen=True, eq=False)
class HalfMesh:
    """
    The n functions on half of the liquid in a section, span by span of the knots in rho.

    Attributes
    ----------
    on_axis : array of bool, shape (n,)
        Which functions do not vanish on the symmetry plane.
    fan : Fan
        The functions at single points.
    spans : list of Samples
        For integrals.
    """

    on_axis: NDArray[np.bool_]
    fan: Fan
    spans: list[Samples]

    @classmethod
    def of(cls, section: SymmetricSection, depth: float, resolution: Resolution) -> HalfMesh:
        """
        Sample the functions.

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
        fan = Fan(
            _control_net(section, depth, along), along, _splines(_UNIT, resolution.fan_degree)
        )
        x, weight = np.polynomial.legendre.leggauss(resolution.degree)
        half = np.diff(breaks)[:, np.newaxis] / 2.0
        rho = (breaks[:-1, np.newaxis] + half * (1.0 + x)).ravel()
        splines = [along(rho, i).reshape(len(half), len(x), -1) for i in (0, 1)]
        products = _Products.of(fan, resolution.fan_degree + 2)
        spans = [
            _sampled(fan, products, *span)
            for span in zip(rho.reshape(half.shape[0], -1), half * weight, *splines, strict=True)
        ]
        if min(float(span.weight.min()) for span in spans) <= 0.0:
            raise InputError(
                'the wall of the section turns back under or over the free surface; '
                'only sections that are convex, or nearly so, can be computed'
            )
        on_surface, across = along.c.shape[1], fan.across.c.shape[1]
        numbers = np.arange(on_surface + (on_surface - 1) * (across - 1))
        return cls(
            on_axis=(numbers == on_surface - 1) | (numbers > numbers[-1] - (across - 1)),
            fan=fan,
            spans=spans,
        )

    def matrix(self, of: Callable[[Samples], Array]) -> Array:
        """Add up the matrices that a function makes of each span, shape (n, n)."""
        total = np.zeros((len(self.on_axis), len(self.on_axis)))
        for span in self.spans:
            total[np.ix_(span.which, span.which)] += of(span)
        return total

    def vector(self, of: Callable[[Samples], Array]) -> Array:
        """Add up the vectors that a function makes of each span, shape (n,)."""
        total = np.zeros(len(self.on_axis))
        for span in self.spans:
            total[span.which] += of(span)
        return total


class _Products(NamedTuple):
    """
    What the products are made of along t, at Gauss points: values and derivatives.

    Attributes
    ----------
    t_weight : array, shape (q,)
    across, blend : tuple of two arrays, shape (q, f) and (q, 4)
        Of the functions, and of the rays.
    """

    t_weight: Array
    across: tuple[Array, Array]
    blend: tuple[Array, Array]

    @classmethod
    def of(cls, fan: Fan, order: int) -> _Products:
        t, t_weight = _gauss(_UNIT, order)
        bernstein = _splines(_UNIT, len(fan.net) - 1)
        return cls(t_weight, (fan.across(t), fan.across(t, 1)), (bernstein(t), bernstein(t, 1)))


def _sampled(
    fan: Fan,
    products: _Products,
    rho: Array,
    rho_weight: Array,
    splines: Array,
    slopes: Array,
) -> Samples:
    """
    Functions on one span, of all splines in rho and their slopes, shape (r, m).

    Where the map folds over, some weight is not positive.
    """
    among = np.flatnonzero(splines.any(axis=0))
    starts = among[0] == 0
    own = splines[:, among], slopes[:, among]

    def product(i: int, across: Array) -> Array:
        values = np.einsum('ri,qj->rqij', own[i], across)
        values = values.reshape(-1, *values.shape[2:])
        return _joined(values) if starts else values.reshape(len(values), -1)

    # the map P and the functions, each with its derivatives by rho and by t
    rays = [np.einsum('kdi,ri->kdr', fan.net[..., among], values) for values in own]
    orders = ((0, 0), (1, 0), (0, 1))
    (y, z), (y_rho, z_rho), (y_t, z_t) = (
        np.einsum('kdr,tk->drt', rays[i], products.blend[j]).reshape(2, -1, 1) for i, j in orders
    )
    v, v_rho, v_t = (product(i, products.across[j]) for i, j in orders)
    jacobian = y_rho * z_t - z_rho * y_t
    safe = np.where(jacobian > 0.0, jacobian, 1.0)
    # arc length per rho, on the last ray
    speed = np.hypot(*rays[1][-1])
    # at the ends of t, the surface and the wall, one function of t is 1, the others vanish
    first, last = np.eye(products.across[0].shape[1])[[0, -1], np.newaxis]
    return Samples(
        which=_numbers(among, fan),
        y=y[:, 0],
        z=z[:, 0],
        weight=(np.outer(rho_weight, products.t_weight).reshape(-1, 1) * jacobian)[:, 0],
        v=v,
        v_y=(z_t * v_rho - z_rho * v_t) / safe,
        v_z=(y_rho * v_t - y_t * v_rho) / safe,
        wall_y=rays[0][-1, 0],
        wall_weight=rho_weight * speed,
        wall=product(0, last),
        along_wall=product(1, last) / speed[:, np.newaxis],
        surface_y=fan.radius * (1.0 - rho),
        surface_weight=fan.radius * rho_weight,
        surface=product(0, first),
    )


def _numbers(among: NDArray[np.intp], fan: Fan) -> NDArray[np.intp]:
    """Numbers of the products of these splines in rho, in the order of :func:`_joined`."""
    first, across = fan.along.c.shape[1], fan.across.c.shape[1] - 1
    inner = np.arange(across)
    if among[0] == 0:
        rest = among[1:]
        below = first + np.add.outer((rest - 1) * across, inner)
        return np.concatenate([[0], rest, below.ravel()])
    below = first + np.add.outer((among - 1) * across, inner)
    return np.column_stack([among, below]).ravel()


def half_section(
    section: SymmetricSection, depth: float, resolution: Resolution = DEFAULT
) -> HalfSection:
    """
    Functions on half of the liquid in a section; see :meth:`HalfMesh.of`.

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
    mesh = HalfMesh.of(section, depth, resolution)
    matrix, vector, m = mesh.matrix, mesh.vector, mesh.fan.along.c.shape[1]
    return HalfSection(
        stiffness=matrix(lambda s: gram(s.v_y, s.weight) + gram(s.v_z, s.weight)),
        mass=matrix(lambda s: gram(s.v, s.weight)),
        d_dy=vector(lambda s: s.weight @ s.v_y),
        d_dz=vector(lambda s: s.weight @ s.v_z),
        y=vector(lambda s: (s.weight * s.y) @ s.v),
        z=vector(lambda s: (s.weight * s.z) @ s.v),
        roll=vector(lambda s: (s.weight * s.y) @ s.v_z - (s.weight * s.z) @ s.v_y),
        wall_mass=matrix(lambda s: gram(s.wall, s.wall_weight)),
        wall_stiffness=matrix(lambda s: gram(s.along_wall, s.wall_weight)),
        surface_mass=matrix(lambda s: gram(s.surface, s.surface_weight))[:m, :m],
        surface_one=vector(lambda s: s.surface_weight @ s.surface)[:m],
        surface_y=vector(lambda s: (s.surface_weight * s.surface_y) @ s.surface)[:m],
        surface=mesh.fan.along,
        on_axis=mesh.on_axis,
        fan=mesh.fan,
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


def _joined(product: Array) -> Array:
    """Functions that are continuous, of products at p points, shape (p, m, f)."""
    # rho = 0 is one point, whatever t: there the f products make up one function
    contact = product[:, 0].sum(axis=1, keepdims=True)
    return np.hstack([contact, product[:, 1:, 0], product[:, 1:, 1:].reshape(len(product), -1)])


def gram(columns: Array, weight: Array) -> Array:
    """
    Scalar products of all columns with one another.

    Parameters
    ----------
    columns : array, shape (p, n)
        Values of functions at points.
    weight : array, shape (p,)
        Of the points, not negative.
    """
    rooted = np.sqrt(weight)[:, np.newaxis] * columns
    return np.asarray(rooted.T @ rooted)
