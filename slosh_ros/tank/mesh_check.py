"""
Whether triangles make up the inner surface of one tank, and what of their faults is harmless.

Harmless are corners that are given several times, triangles without area or given twice, and
normals that point inwards or every way: these are repaired, and it is told. A surface that is
open, meets itself or encloses several bodies cannot be guessed right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.tank.sizes import LARGEST, SMALLEST
from slosh_ros.tank.surface import Array, solid_moments

Indices = NDArray[np.intp]

MOST = 50_000  # triangles; more tell no more about the liquid
_WELD = 1e-6  # [sizes] corners closer than this are one: files have six digits
_FLAT = 1e-6  # [sizes^3] less volume is none
_WALL = 0.2  # share of the outer volume between two surfaces, below which they are a wall's
_TOUCH = 1e-13  # [sizes^3] volume that tells a crossing from a touch and from rounding
_CHUNK = 2_000_000  # pairs or solid angles at a time


class SoundSurface(NamedTuple):
    """
    A closed surface, its normals outwards.

    Attributes
    ----------
    vertices : array, shape (n, 3)
        Corners [m].
    faces : array of int, shape (m, 3)
        Of the triangles.
    repairs : tuple of str
        What has been repaired, in words.
    """

    vertices: Array
    faces: Indices
    repairs: tuple[str, ...]


def checked(vertices: Array, faces: Indices) -> SoundSurface:
    """
    Check a surface, and repair what is harmless.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        Corners, as a file has them [m].
    faces : array of int, shape (m, 3)
        Of the triangles.

    Raises
    ------
    InputError
        If it is not the inner surface of one tank; the message says what is wrong, and begins
        with a verb.
    """
    if not np.isfinite(vertices).all():
        raise InputError('has coordinates that are not finite numbers; write the file anew')
    if len(faces) == 0:
        raise InputError("has no triangles; it must hold the tank's inner surface")
    if len(faces) > MOST:
        raise InputError(
            f'has {len(faces)} triangles; write it more coarsely, with {MOST} at most'
        )
    _check_size(vertices[faces].reshape(-1, 3))
    vertices, faces, repairs = _welded(vertices, faces)
    _check_closed(vertices, faces)
    faces, turned = _oriented(vertices, faces)
    _check_crossing(vertices, faces)
    return SoundSurface(vertices, faces, (*repairs, *turned))


def winding(points: Array, triangles: Array) -> Array:
    """
    How often a closed surface winds around points: 1 inside, 0 outside.

    By solid angles (van Oosterom & Strackee 1983, IEEE Trans. Biomed. Eng. 30).

    Parameters
    ----------
    points : array, shape (p, 3)
        The points.
    triangles : array, shape (n, 3, 3)
        Corners, normals outwards.
    """
    step = max(1, _CHUNK // max(len(triangles), 1))
    parts = []
    for begin in range(0, len(points), step):
        a, b, c = (triangles[:, k] - points[begin : begin + step, np.newaxis] for k in range(3))
        la, lb, lc = (np.linalg.norm(corner, axis=-1) for corner in (a, b, c))
        volume = np.sum(a * np.cross(b, c), axis=-1)
        flat = la * lb * lc + np.sum(a * b, -1) * lc + np.sum(b * c, -1) * la
        flat += np.sum(c * a, -1) * lb
        parts.append(np.arctan2(volume, flat).sum(axis=1) / (2.0 * np.pi))
    return np.concatenate(parts) if parts else np.zeros(0)


def _check_size(corners: Array) -> None:
    sides = np.ptp(corners, axis=0)
    box = ' x '.join(f'{side:.4g}' for side in sides) + ' m'
    if sides.max() > LARGEST:
        raise InputError(
            f'has a bounding box of {box}, larger than any tank; if it is in millimetres, write '
            'mesh_scale: 0.001'
        )
    if sides.max() < SMALLEST:
        raise InputError(
            f'has a bounding box of {box}, smaller than any tank; if it is in kilometres or has '
            'been scaled twice, write mesh_scale: 1000.0'
        )
    if sides.min() < _WELD * sides.max():
        raise InputError(
            f"has a bounding box of {box}: it is flat; write the tank's whole surface"
        )


def _welded(vertices: Array, faces: Indices) -> tuple[Array, Indices, list[str]]:
    """Make corners at the same place one, and leave out triangles that are none or repeated."""
    size = float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())
    exact, number = np.unique(vertices[faces].reshape(-1, 3), axis=0, return_inverse=True)
    pairs = scipy.spatial.cKDTree(exact).query_pairs(_WELD * size, output_type='ndarray')
    graph = scipy.sparse.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(exact), len(exact)))
    count, place = scipy.sparse.csgraph.connected_components(graph, directed=False)
    first = np.unique(place, return_index=True)[1]
    repairs = []
    if count < len(exact):
        repairs.append(f'{len(exact) - count} corners that differ by rounding are merged')
    faces = place[number.reshape(-1)].reshape(-1, 3).astype(np.intp)
    a, b, c = faces.T
    proper = (a != b) & (b != c) & (c != a)
    if not proper.all():
        repairs.append(f'{np.count_nonzero(~proper)} triangles without area are left out')
    faces = faces[proper]
    # turned so that the lowest number comes first: the same way round is the same triangle
    turn = (faces.argmin(axis=1)[:, np.newaxis] + np.arange(3)) % 3
    unique = np.unique(np.take_along_axis(faces, turn, axis=1), axis=0, return_index=True)[1]
    if len(unique) < len(faces):
        repairs.append(f'{len(faces) - len(unique)} triangles given twice are left out')
    return exact[first], faces[np.sort(unique)], repairs


def _edges(faces: Indices) -> Indices:
    """Return the ends of the edges of each triangle, in its direction, shape (m, 3, 2)."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)


def _check_closed(vertices: Array, faces: Indices) -> None:
    """Check that each edge joins two triangles."""
    edges, count = np.unique(
        np.sort(_edges(faces).reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    for wrong, what, remedy in (
        (count == 1, 'is open: {} edges belong to one triangle only', 'close the gaps'),
        (
            count > 2,
            'has {} edges at which more than two triangles meet',
            "give the tank's inner surface alone, without inner sheets or bodies that touch",
        ),
    ):
        if wrong.any():
            where = _told(vertices[edges[wrong.argmax()]].mean(axis=0))
            number = what.format(np.count_nonzero(wrong))
            raise InputError(f'{number}, the first at {where}; {remedy}')


def _oriented(vertices: Array, faces: Indices) -> tuple[Indices, list[str]]:
    """Turn triangles so that all normals point out of the liquid."""
    directed = _edges(faces).reshape(-1, 2)
    order = np.lexsort(np.sort(directed, axis=1).T)
    owner, is_up = order // 3, directed[order, 0] < directed[order, 1]
    left, right = owner[::2], owner[1::2]
    clash = is_up[::2] == is_up[1::2]  # both pass along their edge in the same direction
    size = len(faces)
    graph = scipy.sparse.coo_matrix(
        (np.ones(len(left)), (left, right)), shape=(size, size)
    ).tocsr()
    graph = graph + graph.T
    _, part = scipy.sparse.csgraph.connected_components(graph, directed=False)
    flip = np.zeros(size, dtype=bool)
    pairs = zip(left.tolist(), right.tolist(), clash.tolist(), strict=True)
    opposed = {pair: c for a, b, c in pairs for pair in ((a, b), (b, a))}
    for begin in np.unique(part, return_index=True)[1]:
        found, before = scipy.sparse.csgraph.breadth_first_order(graph, begin, directed=False)
        for face in found[1:].tolist():
            flip[face] = flip[before[face]] != opposed[before[face], face]
    if np.any((flip[left] != flip[right]) != clash):
        raise InputError('has one side only, like a Moebius strip; write the file anew')
    turned = faces.copy()
    turned[flip] = turned[flip][:, ::-1]

    parts = [np.flatnonzero(part == k) for k in range(int(part.max()) + 1)]
    volumes = np.array([solid_moments(vertices[turned[p]]).whole for p in parts])
    if np.abs(volumes).max() < _FLAT * float(np.ptp(vertices, axis=0).max()) ** 3:
        raise InputError("encloses no volume; write the tank's whole inner surface")
    nested = np.zeros(len(parts), dtype=int)
    for i, p in enumerate(parts):
        point = vertices[turned[p[0], :1]]
        nested[i] = sum(
            int(np.rint(np.abs(winding(point, vertices[turned[q]])))[0])
            for j, q in enumerate(parts)
            if j != i
        )
    if np.count_nonzero(nested % 2 == 0) > 1:
        raise InputError(
            f'encloses {np.count_nonzero(nested % 2 == 0)} separate bodies; write a tank for each'
        )
    for p, volume, depth in zip(parts, volumes, nested, strict=True):
        if (volume > 0.0) == (depth % 2 == 1):
            turned[p], flip[p] = turned[p][:, ::-1], ~flip[p]
    told = []
    if len(parts) > 1:
        whole = float(np.abs(volumes).max())
        between = float(np.sum(np.where(nested % 2 == 0, 1.0, -1.0) * np.abs(volumes)))
        if between < _WALL * whole:
            raise InputError(
                f'has one surface within another, with {between:.3g} m^3 between them and '
                f'{whole - between:.3g} m^3 within: these are the two sides of a wall; write the '
                'inner one alone'
            )
        told = [f'it has {whole - between:.3g} m^3 closed off within, which stay dry']
    count = int(np.count_nonzero(flip))
    if count == size:
        return turned, [*told, 'its normals pointed inwards and are turned']
    if count:
        told.append(f'{count} of {size} triangles faced inwards and are turned')
    return turned, told


def _check_crossing(vertices: Array, faces: Indices) -> None:
    """Check that no triangle passes through another that it does not touch with a corner."""
    corners = vertices[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    # along the axis on which the triangles are shortest, one after the other
    axis = int(np.argmin((high - low).mean(axis=0) / np.ptp(vertices, axis=0)))
    order = np.argsort(low[:, axis])
    low, high, corners, faces = low[order], high[order], corners[order], faces[order]
    last = np.searchsorted(low[:, axis], high[:, axis], side='right')
    ahead = last - np.arange(len(faces)) - 1
    touch = _TOUCH * float(np.ptp(vertices, axis=0).max()) ** 3
    begin = 0
    while begin < len(faces):
        end = begin + max(1, int(np.searchsorted(np.cumsum(ahead[begin:]), _CHUNK)))
        number = ahead[begin:end]
        i = np.repeat(np.arange(begin, begin + len(number)), number)
        j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(number) - number, number)
        near = np.all((low[j] <= high[i]) & (low[i] <= high[j]), axis=1)
        i, j = i[near], j[near]
        apart = ~np.any(faces[i][:, :, np.newaxis] == faces[j][:, np.newaxis], axis=(1, 2))
        i, j = i[apart], j[apart]
        crossing = _pierced(corners[i], corners[j], touch) | _pierced(
            corners[j], corners[i], touch
        )
        if crossing.any():
            where = _told(corners[i[crossing.argmax()]].mean(axis=0))
            raise InputError(
                f'passes through itself, first near {where}; mend it, or unite the parts'
            )
        begin = end


def _pierced(triangles: Array, others: Array, touch: float) -> NDArray[np.bool_]:
    """Tell which triangles are pierced by an edge of the other of each pair."""
    a, b, c = triangles.transpose(1, 0, 2)
    found = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        p, q = others[:, k], others[:, (k + 1) % 3]
        side_p, side_q = _volume(a, b, c, p), _volume(a, b, c, q)
        through = np.stack([_volume(p, q, *pair) for pair in ((a, b), (b, c), (c, a))])
        apart = (np.minimum(side_p, side_q) < -touch) & (np.maximum(side_p, side_q) > touch)
        found |= apart & (np.all(through > touch, axis=0) | np.all(through < -touch, axis=0))
    return found


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volumes of tetrahedra."""
    return np.asarray(np.sum((a - d) * np.cross(b - d, c - d), axis=-1))


def _told(point: Array) -> str:
    return f'({", ".join(f"{x:.4g}" for x in point)}) m'
