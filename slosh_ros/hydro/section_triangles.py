"""
Functions on triangles for sections that are polygons, also where their corners are singular.

At a corner of the angle alpha the solution goes with the distance as r^(pi/alpha). Triangles get
smaller towards it in geometric progression, and the degree of the polynomials on them falls:
errors then fall exponentially with the cube root of the number of functions (Guo & Babuska 1986,
Comput. Mech. 1). Straight walls are met exactly.

The triangles' functions are too many for a dense eigenproblem. What is needed of them are the
solutions of (K + k^2 M) v = load for the waves on the free surface and for the tank's rotation,
for k from 0 to the shortest mode's wave number. Those for a few k, with their derivatives by k^2,
span all others to many digits (rational Krylov space: Ruhe 1984, Linear Algebra Appl. 58); a basis
of them is what goes on. Where corners are near the surface, waves are no polynomials: a few
polynomials are the first loads, the lowest waves among their solutions the next ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu
from scipy.special import eval_jacobi, roots_jacobi

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.section_functions import Parity, SectionFunctions
from slosh_ros.tank.polygon import ROUNDING, Polygon, below
from slosh_ros.tank.triangulation import Indices, corner_angles, triangulate

_SIDES = ((0, 1), (1, 2), (0, 2))  # corners of each side of a triangle

_GROWTH = 0.6  # of the triangles' size with the depth below the free surface
_CUT = 0.2  # ratio of sizes of triangles from one layer around a corner to the next
# Fall of the degree from a size of triangles to half that size. It is slower around sharp corners,
# and around the ends of the surface: there the highest wave is read off, which is no energy, so
# that its error is not squared.
_SLOPE, _SLOPE_AT_ENDS, _SLOPE_SHARP = 0.9, 0.7, 0.3
_AT_ENDS = 1e-5  # share of the error left to a corner that is left to one near an end
_NEAR_END = 0.1  # [half-waves]
_LEAST_DEGREE = 3
_REGULAR = 3.0  # exponent of a corner that needs no layers
_SHARP_EXPONENT, _SHARP_STRENGTH = 1.05, 0.1  # at most, at least: of a corner that juts in
_STEADY = 1e-4  # k that stands for 0, for which K + k^2 M is singular, over the largest k
_DEPENDENT = 1e-13  # [-] share of the Gram matrix that is rounding
_PANEL = 4  # columns that SuperLU takes together: of these matrices they are short
_FOUND = 1e-5  # [widths of the section] that a point may lie outside, for rounding


@dataclass(frozen=True)
class TriangleResolution:
    """
    Size of the discrete problem.

    Attributes
    ----------
    degree : int
        Highest degree of the polynomials.
    half_waves : float
        Largest triangle at the free surface, in half-waves of the shortest mode.
    corner : float
        Error of an energy that is left to a corner.
    loads : int
        Polynomials on each piece of the free surface that are the first loads, besides two for
        each half-wave.
    poles : float
        Wave numbers k for which they are solved for, per decade, besides three.
    """

    degree: int = 9
    half_waves: float = 1.0
    corner: float = 1e-6
    loads: int = 6
    poles: float = 1.5


DEFAULT_TRIANGLES = TriangleResolution()


def polygon_functions(
    section: Polygon,
    depth: float,
    wave_numbers: tuple[float, float],
    resolution: TriangleResolution = DEFAULT_TRIANGLES,
) -> tuple[SectionFunctions, ...]:
    """
    Functions on the liquid in a polygonal section: even and odd ones if it is symmetric.

    Parameters
    ----------
    section : Polygon
        The section.
    depth : float
        Depth of the liquid [m].
    wave_numbers : (float, float)
        Smallest k > 0 and largest wave number of interest [1/m].
    resolution : TriangleResolution
        Number and degree of the functions.

    Raises
    ------
    InputError
        If the liquid has details too small to be computed.
    """
    outline = section.liquid_outline(depth)
    if not section.is_symmetric:
        mesh = _mesh(outline, False, wave_numbers[1], resolution)
        integrals = _integrals(mesh)
        return (
            _reduced(mesh, integrals, _order(integrals), Parity.NONE, wave_numbers, resolution),
        )
    # y > 0 is below zero once turned clockwise
    turned = np.stack([outline[:, 1], -outline[:, 0]], axis=1)
    (half,) = below(turned, ROUNDING * max(section.bounding_box))
    right = np.stack([-half[:, 1], half[:, 0]], axis=1) + 0.0
    mesh = _mesh(right, True, wave_numbers[1], resolution)
    integrals = _integrals(mesh)
    order = _order(integrals)
    return tuple(
        _reduced(mesh, integrals, order, parity, wave_numbers, resolution)
        for parity in (Parity.EVEN, Parity.ODD)
    )


# --- shape functions on a triangle ---------------------------------------------------------------


class _Reference(NamedTuple):
    """
    Integrals of the shape functions v of one degree, over the area of a triangle.

    A triangle has the barycentric coordinates L_0, L_1, L_2; d_a is the derivative by L_a.

    Attributes
    ----------
    stiffness : array, shape (3, 3, f, f)
        d_a v_i d_b v_j.
    mass : array, shape (f, f)
        v_i v_j.
    slopes : array, shape (3, 3, f)
        d_a v_i L_b.
    """

    stiffness: Array
    mass: Array
    slopes: Array


def _jacobi(n: int, x: Array) -> tuple[Array, Array]:
    """Jacobi's polynomial P_n^(1,1) and its derivative."""
    if n == 0:
        return np.ones_like(x), np.zeros_like(x)
    return eval_jacobi(n, 1, 1, x), (n + 3) / 2.0 * eval_jacobi(n - 1, 2, 2, x)


def _bubbles(degree: int) -> list[tuple[int, int]]:
    """Degrees of the factors of the shape functions that vanish on all sides."""
    return [(i, j) for i in range(degree - 2) for j in range(degree - 2 - i)]


def _shape_degrees(degree: int) -> NDArray[np.intp]:
    """Degree of each shape function: those of corners, of sides and of the inside."""
    sides = 3 * list(range(2, degree + 1))
    return np.array([1, 1, 1, *sides, *(i + j + 3 for i, j in _bubbles(degree))])


def _shapes(place: Array, degree: int) -> tuple[Array, Array]:
    """
    Shape functions at places L, shape (3, p): values (f, p) and derivatives (3, f, p).

    Those of a side, L_a L_b P_n(L_b - L_a), have the sign of its direction.
    """
    values = list(place)
    slopes = [np.outer(row, np.ones_like(place[0])) for row in np.eye(3)]
    for a, b in _SIDES:
        for n in range(degree - 1):
            f, df = _jacobi(n, place[b] - place[a])
            both = place[a] * place[b]
            slope = np.zeros_like(place)
            slope[a], slope[b] = place[b] * f - both * df, place[a] * f + both * df
            values.append(both * f)
            slopes.append(slope)
    inner = np.prod(place, axis=0)
    rest = np.stack([place[1] * place[2], place[0] * place[2], place[0] * place[1]])
    for i, j in _bubbles(degree):
        f, df = _jacobi(i, place[1] - place[0])
        g, dg = _jacobi(j, 2.0 * place[2] - 1.0)
        values.append(inner * f * g)
        slopes.append(rest * f * g + inner * np.stack([-df * g, df * g, 2.0 * f * dg]))
    return np.array(values), np.array(slopes).transpose(1, 0, 2)


@cache
def _reference(degree: int) -> _Reference:
    """Integrals by a product of Gauss rules on the square, folded to the triangle."""
    x, x_weight = roots_jacobi(degree + 1, 0, 0)
    y, y_weight = roots_jacobi(degree + 1, 1, 0)
    s, t = (axis.ravel() for axis in np.meshgrid((1.0 + x) / 2.0, (1.0 + y) / 2.0))
    weight = np.outer(y_weight, x_weight).ravel() / 4.0  # of an area of 1
    place = np.stack([s * (1.0 - t), (1.0 - s) * (1.0 - t), t])
    v, dv = _shapes(place, degree)
    return _Reference(
        stiffness=np.einsum('aip,bjp,p->abij', dv, dv, weight, optimize=True),
        mass=(v * weight) @ v.T,
        slopes=np.einsum('aip,bp,p->abi', dv, place, weight, optimize=True),
    )


def _side_shapes(share: Array, degree: int) -> tuple[Array, Array]:
    """Shape functions along a side, at shares of its length, and derivatives by the share."""
    place = np.stack([1.0 - share, share, np.zeros_like(share)])
    v, dv = _shapes(place, degree)
    own = [0, 1, *range(3, 2 + degree)]  # its two corners, then its own
    return v[own], (dv[1] - dv[0])[own]


# --- the mesh ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Mesh:
    """
    Triangles and the functions on them.

    Attributes
    ----------
    points : array, shape (m, 2)
        Corners [m].
    triangles : array of int, shape (t, 3)
        Corners of each triangle, rising, so that neighbours agree in the direction of a side.
    is_half : bool
        Whether y = 0 is the symmetry plane.
    degree : int
        Highest degree.
    functions : array of int, shape (t, f)
        Number of the function that is each shape function; -1 for none.
    count : int
        Number of functions n.
    sides : array of int, shape (s, 2)
        Ends of the sides at the edge of the mesh.
    side_functions : array of int, shape (s, degree + 1)
        Functions on them, in the order of :func:`_side_shapes`; -1 for none.
    """

    points: Array
    triangles: Indices
    is_half: bool
    degree: int
    functions: Indices
    count: int
    sides: Indices
    side_functions: Indices

    @property
    def on_surface(self) -> NDArray[np.bool_]:
        """Which sides are free surface."""
        return np.asarray(np.all(self.points[self.sides, 1] == 0.0, axis=1))

    @property
    def on_axis(self) -> NDArray[np.bool_]:
        """Which sides are on the symmetry plane."""
        return np.asarray(self.is_half & np.all(self.points[self.sides, 0] == 0.0, axis=1))

    def linear(self, values: Array) -> Array:
        """Coefficients of a function that is linear on every triangle, from its corners."""
        coefficients = np.zeros(self.count)
        coefficients[: len(self.points)] = values
        return coefficients


def _mesh(
    outline: Array, is_half: bool, wave_number: float, resolution: TriangleResolution
) -> _Mesh:
    """Triangulate a polygon, with layers of triangles around its corners."""
    at_surface = resolution.half_waves * np.pi / wave_number

    def size(points: Array) -> Array:
        return np.asarray(at_surface + _GROWTH * np.abs(points[:, 1]))

    points, triangles = triangulate(outline, size)
    exponent, strength = _singularities(outline, is_half)
    ends = outline[_surface_ends(outline) & ~_on_axis(outline, is_half)]
    error = (
        np.where(_nearest(outline, ends) < _NEAR_END * at_surface, _AT_ENDS, 1.0)
        * resolution.corner
    )
    layers = _layers(exponent, strength, points, triangles, at_surface, error)
    points, triangles = _layered(points, triangles, layers)
    triangles = np.sort(triangles, axis=1)
    corners = points[triangles]
    longest = np.max([np.hypot(*(corners[:, a] - corners[:, b]).T) for a, b in _SIDES], axis=0)
    middle = corners.mean(axis=1)
    sharp = outline[(exponent < _SHARP_EXPONENT) & (strength > _SHARP_STRENGTH)]
    slope = np.full(len(middle), _SLOPE)
    for places, there in ((ends, _SLOPE_AT_ENDS), (sharp, _SLOPE_SHARP)):
        slope[_nearest(middle, places) < size(middle)] = there
    degrees = resolution.degree + slope * np.log2(longest / size(middle))
    degrees = np.clip(np.ceil(degrees), _LEAST_DEGREE, resolution.degree).astype(np.intp)
    return _numbered(points, triangles, is_half, degrees, resolution.degree)


def _on_axis(outline: Array, is_half: bool) -> NDArray[np.bool_]:
    """Tell which corners are on the symmetry plane."""
    return np.asarray(is_half & (outline[:, 0] == 0.0))


def _surface_ends(outline: Array) -> NDArray[np.bool_]:
    """Tell which corners are ends of the free surface, or of one of its pieces."""
    before, after = (np.roll(outline[:, 1] == 0.0, i) for i in (1, -1))
    return np.asarray((outline[:, 1] == 0.0) & (before != after))


def _nearest(points: Array, places: Array) -> Array:
    """Distance of points from the nearest of some places, shape (p,)."""
    away = np.hypot(*(points[:, np.newaxis] - places).transpose(2, 0, 1))
    return np.asarray(away.min(axis=1, initial=np.inf))


def _singularities(outline: Array, is_half: bool) -> tuple[Array, Array]:
    """Exponents of the distance at the corners, and how strong each such term may be, 0 to 1."""
    on_axis = _on_axis(outline, is_half)
    angles = np.where(on_axis, 2.0, 1.0) * corner_angles(outline)  # of the whole section
    exponent = np.pi / angles
    # of r^exponent: of a wall that is nearly straight, little; of r^2, a polynomial, nothing
    strength = np.where(
        _surface_ends(outline) & ~on_axis, 1.0, np.minimum(np.abs(angles / np.pi - 1.0), 1.0)
    )
    strength[np.isclose(exponent, 2.0, rtol=0.0, atol=1e-6)] = 0.0
    strength[exponent > _REGULAR] = 0.0
    return exponent, strength


def _layers(
    exponent: Array,
    strength: Array,
    points: Array,
    triangles: Indices,
    half_wave: float,
    error: Array,
) -> NDArray[np.intp]:
    """How many layers of triangles each corner, first of the points, needs."""
    scale = min(half_wave, float(np.sqrt(np.ptp(points, axis=0).prod())))
    layers = np.zeros(len(exponent), dtype=np.intp)
    for i in np.flatnonzero(strength > ROUNDING):
        around = points[np.setdiff1d(triangles[np.any(triangles == i, axis=1)], [i])]
        near = min(1.0, float(np.hypot(*(around - points[i]).T).max()) / scale)
        # strength^2 (near cut^n)^(2 exponent) is left of the energy
        left = np.log(error[i] / strength[i] ** 2) / (2.0 * exponent[i]) - np.log(near)
        layers[i] = max(0, int(np.ceil(left / np.log(_CUT))))
    return layers


def _layered(points: Array, triangles: Indices, layers: NDArray[np.intp]) -> tuple[Array, Indices]:
    """Cut the triangles around the first points again and again, parallel to the far side."""
    places, corners = list(points), [tuple(row) for row in triangles.tolist()]
    for centre, count in enumerate(layers.tolist()):
        for _ in range(count):
            moved: dict[int, int] = {}

            def inwards(i: int, centre: int = centre, moved: dict[int, int] = moved) -> int:
                if i not in moved:
                    moved[i] = len(places)
                    places.append(places[centre] + _CUT * (places[i] - places[centre]))
                return moved[i]

            cut = []
            for triangle in corners:
                if centre not in triangle:
                    cut.append(triangle)
                    continue
                k = triangle.index(centre)
                a, b = triangle[k - 2], triangle[k - 1]
                c, d = inwards(a), inwards(b)
                cut.append((centre, c, d))
                # the quadrilateral that is left, along its shorter diagonal
                one, other = (np.hypot(*(places[i] - places[j])) for i, j in ((a, d), (b, c)))
                cut += [(c, a, d), (a, b, d)] if one < other else [(c, a, b), (c, b, d)]
            corners = cut
    return np.array(places), np.array(corners, dtype=np.intp)


def _numbered(
    points: Array, triangles: Indices, is_half: bool, degrees: NDArray[np.intp], degree: int
) -> _Mesh:
    """Give the functions numbers; on a side the smaller degree of its two triangles holds."""
    count, own = len(triangles), degree - 1
    ends = np.stack([triangles[:, side] for side in _SIDES], axis=1).reshape(-1, 2)
    sides, side, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    side = side.reshape(count, 3)  # of each triangle
    side_degrees = np.full(len(sides), degree)
    np.minimum.at(side_degrees, side.ravel(), np.repeat(degrees, 3))

    on_sides = np.arange(2, degree + 1) <= side_degrees[:, np.newaxis]
    inside = _shape_degrees(degree)[3 + 3 * own :] <= degrees[:, np.newaxis]
    corners = len(points)
    first = corners + int(np.count_nonzero(on_sides))
    side_numbers, inside_numbers = (
        np.where(there, begin + np.cumsum(there).reshape(there.shape) - 1, -1)
        for there, begin in ((on_sides, corners), (inside, first))
    )
    edge = np.flatnonzero(uses == 1)
    return _Mesh(
        points=points,
        triangles=triangles,
        is_half=is_half,
        degree=degree,
        functions=np.hstack([triangles, side_numbers[side].reshape(count, -1), inside_numbers]),
        count=first + int(np.count_nonzero(inside)),
        sides=sides[edge],
        side_functions=np.hstack([sides[edge], side_numbers[edge]]),
    )


# --- integrals -----------------------------------------------------------------------------------


def _matrix(blocks: Array, functions: Indices, count: int) -> csc_matrix:
    """Add up square blocks, shape (b, f, f), at the functions (b, f) that they belong to."""
    shape = blocks.shape
    rows = np.broadcast_to(functions[:, :, np.newaxis], shape)
    columns = np.broadcast_to(functions[:, np.newaxis, :], shape)
    there = (rows >= 0) & (columns >= 0)
    entries = (blocks[there], (rows[there], columns[there]))
    return csc_matrix(entries, shape=(count, count))


def _vectors(blocks: Array, functions: Indices, count: int) -> Array:
    """Add up vectors, shape (b, f, l), at the functions (b, f): shape (count, l)."""
    total = np.zeros((count + 1, blocks.shape[-1]))  # the last takes what is none
    np.add.at(total, functions, blocks)
    return total[:-1]


class _Integrals(NamedTuple):
    """Sparse matrices K, M, S, those of the wall, and the vector of roll, for all functions."""

    stiffness: csc_matrix
    mass: csc_matrix
    surface_mass: csc_matrix
    wall_mass: csc_matrix
    wall_stiffness: csc_matrix
    roll: Array


def _integrals(mesh: _Mesh) -> _Integrals:
    reference = _reference(mesh.degree)
    corners = mesh.points[mesh.triangles]
    opposite = np.stack([corners[:, i - 1] - corners[:, i - 2] for i in range(3)], axis=1)
    double = opposite[:, 0, 0] * opposite[:, 1, 1] - opposite[:, 0, 1] * opposite[:, 1, 0]
    area = np.abs(double) / 2.0
    # gradients of L_0, L_1, L_2, shape (t, 3, 2)
    slopes = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1) / double[:, None, None]
    products = slopes @ slopes.transpose(0, 2, 1) * area[:, None, None]
    shapes = len(reference.mass)
    stiffness = products.reshape(-1, 9) @ reference.stiffness.reshape(9, -1)
    # y dv/dz - z dv/dy
    turning = slopes[..., 1, None] * corners[:, None, :, 0]
    turning = (turning - slopes[..., 0, None] * corners[:, None, :, 1]) * area[:, None, None]
    roll = turning.reshape(-1, 9) @ reference.slopes.reshape(9, -1)

    share, weight = np.polynomial.legendre.leggauss(mesh.degree + 1)
    v, dv = _side_shapes((1.0 + share) / 2.0, mesh.degree)
    length = np.hypot(*np.diff(mesh.points[mesh.sides], axis=1)[:, 0].T)[:, None, None]
    side_mass, side_stiffness = length * ((v * weight) @ v.T / 2.0), (dv * weight) @ dv.T / 2.0
    wall = ~mesh.on_surface & ~mesh.on_axis

    def on(sides: NDArray[np.bool_], blocks: Array) -> csc_matrix:
        return _matrix(blocks[sides], mesh.side_functions[sides], mesh.count)

    return _Integrals(
        stiffness=_matrix(stiffness.reshape(-1, shapes, shapes), mesh.functions, mesh.count),
        mass=_matrix(area[:, None, None] * reference.mass, mesh.functions, mesh.count),
        surface_mass=on(mesh.on_surface, side_mass),
        wall_mass=on(wall, side_mass),
        wall_stiffness=on(wall, side_stiffness / length),
        roll=_vectors(roll[..., np.newaxis], mesh.functions, mesh.count)[:, 0],
    )


def _surface_loads(mesh: _Mesh, wave_number: float, least: int) -> Array:
    """Integrals over the free surface of the functions times smooth loads, shape (n, l)."""
    sides = mesh.points[mesh.sides[mesh.on_surface], 0]
    functions = mesh.side_functions[mesh.on_surface]
    loads = [np.zeros((mesh.count, 0))]
    for left, right in _pieces(sides):
        inside = (sides.min(axis=1) >= left) & (sides.max(axis=1) <= right)
        begin, end = sides[inside].T[..., np.newaxis]
        degree = least + int(np.ceil(2.0 * wave_number * (right - left) / np.pi))
        share, weight = np.polynomial.legendre.leggauss((mesh.degree + degree) // 2 + 1)
        share = (1.0 + share) / 2.0
        y = begin + share * (end - begin)
        load = legendre.legvander((2.0 * y - left - right) / (right - left), degree)
        v = _side_shapes(share, mesh.degree)[0] * weight / 2.0
        blocks = np.abs(end - begin)[..., np.newaxis] * np.einsum('fp,spl->sfl', v, load)
        loads.append(_vectors(blocks, functions[inside], mesh.count))
    return np.hstack(loads)


def _pieces(sides: Array) -> list[tuple[float, float]]:
    """Intervals that are made up of the given ones, shape (s, 2)."""
    pieces: list[tuple[float, float]] = []
    for left, right in sorted((min(a, b), max(a, b)) for a, b in sides.tolist()):
        if pieces and pieces[-1][1] == left:
            pieces[-1] = (pieces[-1][0], right)
        else:
            pieces.append((left, right))
    return pieces


# --- the reduced basis ---------------------------------------------------------------------------


def _order(integrals: _Integrals) -> NDArray[np.intp]:
    """Order in which the functions are eliminated, for any k and either parity."""
    places = _factors(integrals.stiffness + integrals.mass, 'MMD_AT_PLUS_A').perm_c
    return np.argsort(places)


def _factors(matrix: csc_matrix, order: str = 'NATURAL') -> SuperLU:
    """Factorise a matrix that is symmetric and positive: no pivoting."""
    return splu(
        matrix,
        permc_spec=order,
        diag_pivot_thresh=0.0,
        panel_size=_PANEL,
        options={'SymmetricMode': True},
    )


def _reduced(
    mesh: _Mesh,
    integrals: _Integrals,
    order: NDArray[np.intp],
    parity: Parity,
    wave_numbers: tuple[float, float],
    resolution: TriangleResolution,
) -> SectionFunctions:
    """Few combinations of the functions that hold the solutions for all k."""
    both = 1.0 if parity == Parity.NONE else 2.0  # halves of the section
    chosen = order
    if parity == Parity.ODD:
        chosen = chosen[np.isin(chosen, mesh.side_functions[mesh.on_axis], invert=True)]
    k, m, s, wall_mass, wall_stiffness = (
        both * matrix[chosen][:, chosen].sorted_indices() for matrix in integrals[:5]
    )
    # of odd functions the integrals of even ones vanish, and the other way round
    even, odd = (float(parity != other) for other in (Parity.ODD, Parity.EVEN))
    one = even * mesh.linear(np.ones(len(mesh.points)))[chosen]
    y = odd * mesh.linear(mesh.points[:, 0])[chosen]
    z = even * mesh.linear(mesh.points[:, 1])[chosen]
    roll = odd * both * integrals.roll[chosen]

    at_surface = _surface_loads(mesh, wave_numbers[1], resolution.loads)[chosen]
    loads = np.column_stack([at_surface, roll, m @ y, m @ z])

    def balanced(loads: Array) -> Array:
        """Take out the uniform load: it only lifts the constant, which is there anyway."""
        return loads - np.outer(m @ one, one @ loads) / (one @ (m @ one)) if even else loads

    known = np.column_stack([one, y, z])
    decades = max(np.log10(wave_numbers[1] / wave_numbers[0]), 0.0)
    count = 2 + int(np.round(resolution.poles * decades))
    poles = np.geomspace(wave_numbers[0], max(wave_numbers), count)
    poles = np.append(_STEADY * wave_numbers[1], poles)
    basis = _basis(k, m, s, loads, known, poles, balanced)

    def project(matrix: csc_matrix) -> Array:
        return np.asarray(basis.T @ (matrix @ basis))

    weight, shapes = eigh(project(s))
    there = weight > np.finfo(float).eps * weight[-1]
    every = np.zeros((mesh.count + 1, basis.shape[1]))  # the last is what is none
    every[chosen] = basis
    finder = _Finder(mesh, every, parity)
    return SectionFunctions(
        parity=parity,
        has_constant=parity != Parity.ODD,
        stiffness=project(k),
        mass=project(m),
        d_dy=basis.T @ (k @ y),
        d_dz=basis.T @ (k @ z),
        y=basis.T @ (m @ y),
        z=basis.T @ (m @ z),
        roll=basis.T @ roll,
        wall_mass=project(wall_mass),
        wall_stiffness=project(wall_stiffness),
        surface_root=shapes[:, there] * np.sqrt(weight[there]),
        surface_one=basis.T @ (s @ one),
        surface_y=basis.T @ (s @ y),
        at_surface=finder.at_surface,
        at=finder.values,
    )


def _basis(
    stiffness: csc_matrix,
    mass: csc_matrix,
    surface_mass: csc_matrix,
    loads: Array,
    known: Array,
    poles: Array,
    balanced: Callable[[Array], Array],
) -> Array:
    """Basis of the known functions and of the solutions for some k, by columns."""
    loads = balanced(loads)
    places = mass.indices, mass.indptr
    solutions = [known]
    for k in poles.tolist():
        both = stiffness.data + k**2 * mass.data  # on the same triangles, at the same places
        factors = _factors(csc_matrix((both, *places), shape=mass.shape))
        first = factors.solve(loads)
        # The waves are loads themselves, with all that corners near the surface do to them, and
        # the derivative by k^2 tells of what goes on until the next k.
        waves = _waves(first, loads, surface_mass)
        more = np.hstack([surface_mass @ waves, mass @ first])
        solutions += [first, factors.solve(balanced(more))]
    return _independent(np.hstack(solutions))


def _waves(solutions: Array, loads: Array, surface_mass: csc_matrix) -> Array:
    """Lower half of the modes that are made up of solutions for one k, by columns."""
    energy, shapes = eigh(solutions.T @ loads)
    there = energy > np.finfo(float).eps ** 0.75 * energy[-1]
    scaled = solutions @ (shapes[:, there] / np.sqrt(energy[there]))
    _, shapes = eigh(scaled.T @ (surface_mass @ scaled))
    return np.asarray(scaled @ shapes[:, len(shapes) // 2 :])


def _independent(vectors: Array) -> Array:
    """Orthonormal combinations of vectors, without those that are rounding."""
    size = np.sqrt(np.sum(vectors**2, axis=0))
    vectors = vectors[:, size > 0.0] / size[size > 0.0]
    weight, shapes = eigh(vectors.T @ vectors)
    # what is dropped here is smaller than 1e-6 of a solution, and of its energy 1e-12
    there = weight > _DEPENDENT * weight[-1]
    return np.asarray(vectors @ (shapes[:, there] / np.sqrt(weight[there])))


@dataclass(frozen=True, eq=False)
class _Finder:
    """
    The functions of the basis at single points.

    Attributes
    ----------
    mesh : _Mesh
        The triangles.
    basis : array, shape (n + 1, r)
        The basis, by columns; the last row is zero.
    parity : Parity
        Of the basis; unless NONE, the mesh is half of the section.
    """

    mesh: _Mesh
    basis: Array
    parity: Parity

    def values(self, points: Array) -> Array:
        """
        Values of the functions, shape (p, r).

        Parameters
        ----------
        points : array, shape (p, 2)
            y and z about O [m], within the liquid.

        Raises
        ------
        InputError
            If a point is not in the liquid.
        """
        side = np.ones(len(points))
        if self.parity != Parity.NONE:
            side = np.sign(points[:, 0]) if self.parity == Parity.ODD else side
            points = np.stack([np.abs(points[:, 0]), points[:, 1]], axis=1)
        triangle, place = self._found(points)
        v, _ = _shapes(place, self.mesh.degree)
        rows = np.repeat(np.arange(len(points)), len(v))
        columns = self.mesh.functions[triangle].ravel() % len(self.basis)  # -1 is the last row
        shape = len(points), len(self.basis)
        entries = csr_matrix(((side * v).T.ravel(), (rows, columns)), shape=shape)
        return np.asarray(entries @ self.basis)

    def at_surface(self, y: Array) -> Array:
        """Values of the functions at places of the free surface, shape (p, r)."""
        sides = np.flatnonzero(self.mesh.on_surface)
        right = self.mesh.points[self.mesh.sides[sides], 0].max(axis=1)
        sides, right = sides[np.argsort(right)], np.sort(right)
        away = y if self.parity == Parity.NONE else np.abs(y)
        side = sides[np.minimum(np.searchsorted(right, away), len(sides) - 1)]
        begin, end = self.mesh.points[self.mesh.sides[side], 0].T
        share = np.clip((away - begin) / (end - begin), 0.0, 1.0)
        v, _ = _side_shapes(share, self.mesh.degree)
        sign = np.sign(y) if self.parity == Parity.ODD else np.ones_like(y)
        own = self.basis[self.mesh.side_functions[side]]
        return np.asarray(np.einsum('fp,pfr->pr', sign * v, own))

    def _found(self, points: Array) -> tuple[Indices, Array]:
        """Return triangles, and places L in them, shape (3, p)."""
        corners = self.mesh.points[self.mesh.triangles]
        # of points of the free surface, few triangles are near
        slack = _FOUND * np.ptp(self.mesh.points[:, 0])
        low, high = points.min(axis=0) - slack, points.max(axis=0) + slack
        near = np.all((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high), axis=1)
        near = np.flatnonzero(near) if near.any() else np.arange(len(corners))
        corners = corners[near]
        # L of a point is linear in it
        affine = np.linalg.inv(np.concatenate([corners, np.ones((len(corners), 3, 1))], axis=2))
        every = np.column_stack([points, np.ones(len(points))])
        triangle = np.concatenate(
            [
                np.min(part @ affine, axis=2).argmax(axis=0)
                for part in np.array_split(every, 1 + len(every) // 500)
            ]
        )
        place = np.clip(np.einsum('pc,pca->ap', every, affine[triangle]), 0.0, None)
        place /= place.sum(axis=0)
        reached = np.einsum('ap,pac->pc', place, corners[triangle])
        far = np.hypot(*(points - reached).T) > slack
        if far.any():
            y, z = points[far][0]
            raise InputError(f'the section has no liquid at y = {y:g} m, z = {z:g} m from O')
        return near[triangle], place
