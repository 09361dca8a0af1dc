"""
Triangulation of a polygon, with or without holes, by Delaunay refinement.

Ruppert (1995), J. Algorithms 18: segments that are missing or have a corner of a triangle within
their diametral circle are halved; triangles that are too large or too thin get a corner at their
circumcentre. Where segments meet at an acute angle they are split at powers of two of a length
from the corner, so that they do not split each other for ever, and what lies between them may be
as thin as the angle is (Shewchuk 2002, Comput. Geom. 22).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.errors import InputError

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_THIN = 1.5  # circumradius over the shortest side: smallest angle of 19 degrees
_ACUTE = np.radians(60.5)
_LARGE = 1.3  # [target sizes] side of the regular triangle with the same circumcircle
# Beyond so many triangles, or rounds, the section has details far too small: those that are one
# point to the triangulation would be halved for ever.
_MOST, _ROUNDS = 4000, 300
_ROUNDING = 1e-9
_FLAT = 1e-13  # [largest extent of the outline] height of a triangle that is none


def triangulate(
    outline: Array, size: Callable[[Array], Array] | None, holes: Sequence[Array] = ()
) -> tuple[Array, Indices]:
    """
    Divide a polygon into triangles.

    Parameters
    ----------
    outline : array, shape (n, 2)
        Corners, counter-clockwise.
    size : callable
        Largest side of triangles at given points: array, shape (p, 2), to array, shape (p,).
        None: they may be of any size and shape, and are few.
    holes : sequence of array, shape (n, 2)
        Corners, clockwise, of what is left out.

    Returns
    -------
    points : array, shape (m, 2)
        The corners of the outline first, then those of the holes.
    triangles : array of int, shape (t, 3)
        Their corners.

    Raises
    ------
    InputError
        If details of the outline are so small that the triangles become too many.
    """
    mesh = _Mesh([outline, *holes])
    while size is None:
        triangles = mesh.triangles()
        split = mesh.missing_segments(triangles)
        if not split.any():
            return mesh.points, triangles
        mesh.split(split)
    for _ in range(_ROUNDS):
        triangles = mesh.triangles()
        if max(len(triangles), len(mesh.segments)) > _MOST:
            break
        split = mesh.unfit_segments(triangles, size)
        if split.any():
            mesh.split(split)
        elif not mesh.improve(triangles, size):
            return mesh.points, triangles
    raise InputError(
        f'the liquid has details as small as {mesh.shortest():.2g} m, too small to be computed; '
        'leave them out or change the fill'
    )


class _Mesh:
    """
    Points and segments on their way to a triangulation.

    Attributes
    ----------
    points : array, shape (m, 2)
    segments : array of int, shape (s, 2)
        Ends of the parts of the edges.
    shell : array of int, shape (m,)
        For a point that was put at a power of two from an acute corner, that corner; else -1.
    """

    def __init__(self, outlines: list[Array]) -> None:
        self.points = np.concatenate(outlines)
        rings = np.split(np.arange(len(self.points)), np.cumsum([len(o) for o in outlines])[:-1])
        self.segments: Indices = np.concatenate(
            [np.stack([ring, np.roll(ring, -1)], axis=1) for ring in rings]
        )
        self.shell: Indices = np.full(len(self.points), -1)
        self._outlines = outlines
        self._acute = np.concatenate([corner_angles(outline) for outline in outlines]) < _ACUTE
        self._span = float(np.ptp(outlines[0], axis=0).max())
        # around it, so that no edge of the outline is one of the convex hull; but not far away:
        # what is smaller than some 1e-7 of the whole is beyond the digits of Delaunay's paraboloid
        away = self._span * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        self._middle = outlines[0].mean(axis=0)
        self._frame = self._middle + away

    def shortest(self) -> float:
        """Length of the shortest segment."""
        return float(np.min(2.0 * self._halves()))

    def triangles(self) -> Indices:
        """Delaunay triangles within the outline, counter-clockwise."""
        every = np.vstack([self.points, self._frame]) - self._middle
        found: Indices = scipy.spatial.Delaunay(every).simplices.astype(np.intp)
        found = found[np.all(found < len(self.points), axis=1)]
        found = found[inside(self._outlines, self.points[found].mean(axis=1))]
        corners = self.points[found]
        area = _double_areas(corners)
        found[area < 0.0] = found[area < 0.0, ::-1]
        # corners on one edge may make up triangles without height
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        return np.asarray(found[np.abs(area) > _FLAT * self._span * longest])

    def missing_segments(self, triangles: Indices) -> NDArray[np.bool_]:
        """Tell which segments are not sides of triangles."""
        opposite = _opposite(triangles)
        return np.array([(a, b) not in opposite for a, b in self.segments.tolist()])

    def unfit_segments(
        self, triangles: Indices, size: Callable[[Array], Array]
    ) -> NDArray[np.bool_]:
        """Tell which segments are too long, missing, or have a corner within their circle."""
        opposite = _opposite(triangles)
        apex = np.array([opposite.get((a, b), -1) for a, b in self.segments.tolist()])
        middle, half = self.points[self.segments].mean(axis=1), self._halves()
        within = np.hypot(*(self.points[apex] - middle).T) < half * (1.0 - _ROUNDING)
        return np.asarray((apex < 0) | within | (2.0 * half > size(middle)))

    def split(self, which: NDArray[np.bool_]) -> None:
        """Split segments at their middle, or near it at a power of two from an acute corner."""
        a, b = self.segments[which].T
        half, corners = self._halves()[which], len(self._acute)
        from_a, from_b = ((i < corners) & self._acute[np.minimum(i, corners - 1)] for i in (a, b))
        one = from_a != from_b
        power = self._span * 2.0 ** np.round(np.log2(half / self._span))
        share = np.where(one, power / (2.0 * half), 0.5)
        begin, end = (np.where(one & from_b, *pair) for pair in ((b, a), (a, b)))
        new = len(self.points) + np.arange(len(a))
        self.points = np.vstack(
            [
                self.points,
                (1.0 - share)[:, np.newaxis] * self.points[begin]
                + share[:, np.newaxis] * self.points[end],
            ]
        )
        self.shell = np.append(self.shell, np.where(one, begin, -1))
        self.segments = np.vstack(
            [self.segments[~which], np.stack([a, new], 1), np.stack([new, b], 1)]
        )

    def improve(self, triangles: Indices, size: Callable[[Array], Array]) -> bool:
        """Put corners into triangles that are too large or too thin; tell whether any was."""
        corners = self.points[triangles]
        sides = np.stack(
            [np.hypot(*(corners[:, i - 1] - corners[:, i - 2]).T) for i in range(3)], axis=1
        )
        radius = np.prod(sides, axis=1) / (2.0 * np.abs(_double_areas(corners)))
        shortest = sides.argmin(axis=1)
        ends = np.stack([triangles[np.arange(len(triangles)), shortest - i] for i in (1, 2)])
        # between two points of one shell of an acute corner nothing can be done
        shells = self.shell[ends]
        away = np.hypot(*(self.points[ends] - self.points[shells]).transpose(2, 0, 1))
        wedge = (shells[0] >= 0) & (shells[0] == shells[1]) & np.isclose(*away)
        large = np.sqrt(3.0) * radius > _LARGE * size(corners.mean(axis=1))
        bad = np.flatnonzero(large | ((radius > _THIN * sides.min(axis=1)) & ~wedge))
        bad = bad[np.argsort(-radius[bad])]
        centres = _circumcentres(corners[bad])
        # the worst first, and none within the circle of one that goes before
        chosen: list[int] = []
        for i, centre in enumerate(centres):
            gaps = np.hypot(*(centres[chosen] - centre).T)
            if np.all(gaps > np.maximum(radius[bad[i]], radius[bad[chosen]])):
                chosen.append(i)
        centres = centres[chosen]
        middle, half = self.points[self.segments].mean(axis=1), self._halves()
        gaps = np.hypot(*(centres[:, np.newaxis] - middle).transpose(2, 0, 1))
        hit = gaps < half * (1.0 - _ROUNDING)
        free = ~hit.any(axis=1) & inside(self._outlines, centres)
        count = int(np.count_nonzero(free))
        self.points = np.vstack([self.points, centres[free]])
        self.shell = np.append(self.shell, np.full(count, -1))
        if hit.any():
            self.split(hit.any(axis=0))
        return bool(count or hit.any())

    def _halves(self) -> Array:
        """Half the lengths of the segments."""
        begin, end = self.points[self.segments].transpose(1, 0, 2)
        return np.asarray(np.hypot(*(end - begin).T) / 2.0)


def corner_angles(outline: Array) -> Array:
    """Angles within a polygon at its corners, shape (n,) [rad]."""
    before, after = (np.roll(outline, i, axis=0) - outline for i in (1, -1))
    cross = after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0]
    return np.asarray(np.arctan2(cross, np.sum(before * after, axis=1)) % (2.0 * np.pi))


def inside(outlines: Sequence[Array], points: Array) -> NDArray[np.bool_]:
    """
    Tell which points lie within a polygon with holes.

    A ray along the first axis leaves it an odd number of times.

    Parameters
    ----------
    outlines : sequence of array, shape (n, 2)
        Corners of the polygon and of its holes.
    points : array, shape (p, 2)
        The points.
    """
    start = np.concatenate(outlines)
    end = np.concatenate([np.roll(outline, -1, axis=0) for outline in outlines])
    way = end - start
    y, z = points.T[..., np.newaxis]
    across = (start[:, 1] > z) != (end[:, 1] > z)
    rise = np.where(way[:, 1] == 0.0, 1.0, way[:, 1])
    crossing = start[:, 0] + way[:, 0] / rise * (z - start[:, 1])
    return np.asarray(np.count_nonzero(across & (crossing > y), axis=1) % 2 == 1)


def _opposite(triangles: Indices) -> dict[tuple[int, int], int]:
    """Corner opposite each side, by the ends of the side in counter-clockwise order."""
    found: dict[tuple[int, int], int] = {}
    for a, b, c in triangles.tolist():
        found[a, b], found[b, c], found[c, a] = c, a, b
    return found


def _double_areas(corners: Array) -> Array:
    """Twice the areas of triangles, positive if counter-clockwise."""
    (y, z), (v, w) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return np.asarray(y * w - z * v)


def _circumcentres(corners: Array) -> Array:
    """Centres of the circles through the corners of triangles."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p, q = np.sum(first**2, axis=1), np.sum(second**2, axis=1)
    y = q * first[:, 1] - p * second[:, 1]
    z = p * second[:, 0] - q * first[:, 0]
    away = np.stack([y, z], axis=1) / (2.0 * _double_areas(corners))[:, np.newaxis]
    return np.asarray(corners[:, 0] - away)
