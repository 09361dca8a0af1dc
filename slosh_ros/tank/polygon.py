"""Sections that are any simple polygon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.tank.section import Array, Section, SectionMoments

# Lengths are compared to this share of the section's size: it is rounding, or makes no difference.
ROUNDING = 1e-9
# A level that is no higher above a corner is at it: smaller details are beyond any triangulation.
_LEVEL = 3e-7  # [sizes of the section]
_PINHOLE = 1e-5  # [widths of the section] a narrower surface is none


@dataclass(frozen=True)
class Polygon(Section):
    """
    A simple polygon, made by :meth:`of`.

    Parameters
    ----------
    points : tuple of (float, float)
        Corners y, z, counter-clockwise, about the centre of the bounding box [m].
    """

    points: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, numbers: Sequence[float]) -> Polygon:
        """
        Check the corners of a polygon.

        Parameters
        ----------
        numbers : sequence of float
            y1, z1, y2, z2, ... in order, either way round, from any origin [m]. The first corner
            may be repeated at the end.

        Raises
        ------
        InputError
            If the corners are not those of a simple polygon.
        """
        if len(numbers) % 2:
            raise InputError(
                f'points has {len(numbers)} numbers; it takes pairs y1, z1, y2, z2, ... [m]'
            )
        corners = np.array(numbers, dtype=float).reshape(-1, 2)
        if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
            corners = corners[:-1]
        if len(corners) < 3:
            raise InputError(f'points has {len(corners)} corners; a section has at least 3')
        _check_simple(corners)
        if _area(corners) < 0.0:
            corners = corners[::-1]
        corners = corners - (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        return cls(tuple((float(y), float(z)) for y, z in corners))

    @cached_property
    def corners(self) -> Array:
        """The corners, shape (n, 2) [m]."""
        return np.array(self.points)

    @property
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""
        width, height = np.ptp(self.corners, axis=0)
        return float(width), float(height)

    @property
    def area(self) -> float:
        """Area of the whole section [m^2]."""
        return _area(self.corners)

    @cached_property
    def is_symmetric(self) -> bool:
        """Whether the section is its own mirror image in y = 0."""
        mirrored = self.corners[::-1] * [-1.0, 1.0]
        first = np.hypot(*(self.corners - mirrored[0]).T).argmin()
        away = np.abs(np.roll(self.corners, -first, axis=0) - mirrored)
        return bool(away.max() < ROUNDING * max(self.bounding_box))

    def pools(self, depth: float) -> list[Array]:
        """
        Outlines of the liquid, one for each pool that is not connected with another.

        Parameters
        ----------
        depth : float
            Depth of the liquid above the lowest corner [m].

        Returns
        -------
        list of array, shape (n, 2)
            y about the centre of the bounding box and z about the mean free surface,
            counter-clockwise [m]. A piece of the free surface is an edge with z = 0 exactly.
        """
        level = depth - self.bounding_box[1] / 2.0
        return below(self.corners - [0.0, level], _LEVEL * max(self.bounding_box))

    def moments(self, depth: float) -> SectionMoments:
        """Area moments by Green's theorem, edge by edge."""
        pools = self.pools(depth)
        surface = np.array(sorted(piece for pool in pools for piece in _surface(pool)))
        surface = surface.reshape(-1, 2)
        width = float(np.diff(surface, axis=1).sum())
        # of all pieces together
        centre = float(np.diff(surface**2, axis=1).sum()) / (2.0 * width) if width else 0.0
        if pools and not width:  # full to a top that is a point
            centre = float(self.corners[self.corners[:, 1].argmax(), 0])
        moments = np.array([outline_moments(pool - [centre, 0.0]) for pool in pools]).reshape(
            -1, 6
        )
        area, y, z, yy, yz, zz = (float(moment) for moment in moments.sum(axis=0))
        if self.is_symmetric:
            centre, y, yz = 0.0, 0.0, 0.0  # without rounding
        return SectionMoments(
            area=area,
            z=z,
            yy=yy,
            zz=zz,
            surface=tuple((float(a), float(b)) for a, b in surface - centre),
            surface_y=centre,
            y=y,
            yz=yz,
        )

    def outline(self, points: int = 129) -> Array:
        """Outline of the whole section: its corners."""
        del points
        return self.corners

    def check(self, depth: float) -> None:
        """
        Check that the liquid is one pool with a free surface.

        Raises
        ------
        InputError
            If it lies in several pools, or reaches the surface through a pinhole.
        """
        count, moments = len(self.pools(depth)), self.moments(depth)
        level = f'filled to {moments.area / self.area:.2%}, {depth:g} m deep,'
        if count != 1:
            raise InputError(
                f'{level} the section has {count} pools that are not connected; write a tank for '
                'each, or another fill'
            )
        narrowest = min((right - left for left, right in moments.surface), default=0.0)
        if narrowest < _PINHOLE * self.bounding_box[0]:
            raise InputError(
                f'{level} the section has a free surface only {narrowest:.2g} m wide; write a '
                'slightly different fill'
            )

    def liquid_outline(self, depth: float) -> Array:
        """Outline of the liquid, which must be one pool."""
        (pool,) = self.pools(depth)
        return np.asarray(pool - [self.moments(depth).surface_y, 0.0])


def below(corners: Array, rounding: float) -> list[Array]:
    """
    Cut a simple polygon at z = 0 and return what lies below.

    Parameters
    ----------
    corners : array, shape (n, 2)
        Counter-clockwise.
    rounding : float
        Corners so close to z = 0 count as above, unless they are tops of the section.

    Returns
    -------
    list of array, shape (m, 2)
        Polygons, counter-clockwise; of the corners on the cut, z is exactly zero.
    """
    is_below = corners[:, 1] < -rounding
    # a top that only touches the cut is not cut off
    before, behind = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    convex = before[:, 1] * behind[:, 0] > before[:, 0] * behind[:, 1]
    touching = np.abs(corners[:, 1]) <= rounding
    is_below |= touching & convex & np.roll(is_below, 1) & np.roll(is_below, -1)
    if is_below.all() or not is_below.any():
        return [corners] if is_below.any() else []
    after = np.roll(is_below, -1)
    down, up = np.flatnonzero(~is_below & after), np.flatnonzero(is_below & ~after)
    up = np.roll(up, -int(np.searchsorted(up, down[0])))  # chain i: from down[i] to up[i]
    cut_down, cut_up = _at_zero(corners, down), _at_zero(corners, up)
    # Along the cut from the right, the polygon is left at every first and entered at every second
    # crossing: the end of each chain is joined to the beginning of another.
    leaving, entering = np.argsort(cut_up), np.argsort(cut_down)
    follows = dict(zip(leaving.tolist(), entering.tolist(), strict=True))
    outlines: list[Array] = []
    left = set(follows)
    while left:
        outline: list[Array] = []
        chain = min(left)
        while chain in left:
            left.remove(chain)
            length = (up[chain] - down[chain]) % len(corners)
            outline += [
                np.array([cut_down[chain], 0.0]),
                *np.roll(corners, -int(down[chain]) - 1, axis=0)[:length],
                np.array([cut_up[chain], 0.0]),
            ]
            chain = follows[chain]
        outlines.append(np.array(outline))
    return outlines


def _at_zero(corners: Array, edges: NDArray[np.intp]) -> Array:
    """Places y where edges, told by their first corner, meet z = 0."""
    begin, end = corners[edges], np.roll(corners, -1, axis=0)[edges]
    share = np.clip(begin[:, 1] / (begin[:, 1] - end[:, 1]), 0.0, 1.0)
    return np.asarray(begin[:, 0] + share * (end[:, 0] - begin[:, 0]))


def _surface(outline: Array) -> list[tuple[float, float]]:
    """Pieces of the free surface of a pool, from y to y."""
    before = np.roll(outline, 1, axis=0)  # counter-clockwise, the surface runs from right to left
    flat = (outline[:, 1] == 0.0) & (before[:, 1] == 0.0)
    return [(float(a), float(b)) for a, b in zip(outline[flat, 0], before[flat, 0], strict=True)]


def _area(corners: Array) -> float:
    return float(outline_moments(corners)[0])


def outline_moments(corners: Array) -> Array:
    """
    Integrals of 1, y, z, y^2, y z and z^2 over a polygon, shape (6,).

    Parameters
    ----------
    corners : array, shape (n, 2)
        y and z, counter-clockwise; clockwise, all integrals change their sign.
    """
    (y, z), (v, w) = corners.T, np.roll(corners, -1, axis=0).T  # of each edge's two ends
    cross = y * w - v * z
    return np.array(
        [
            cross.sum() / 2.0,
            (y + v) @ cross / 6.0,
            (z + w) @ cross / 6.0,
            (y**2 + y * v + v**2) @ cross / 12.0,
            (2.0 * (y * z + v * w) + y * w + v * z) @ cross / 24.0,
            (z**2 + z * w + w**2) @ cross / 12.0,
        ]
    )


def _check_simple(corners: Array) -> None:
    """
    Check that edges meet only at common corners.

    Raises
    ------
    InputError
        If they do not; the message counts the corners from 1.
    """
    size = float(np.ptp(corners, axis=0).max())
    near = ROUNDING * size
    start, end = corners, np.roll(corners, -1, axis=0)
    way = end - start
    repeated = np.flatnonzero(np.hypot(*way.T) <= near)
    if repeated.size:
        i = int(repeated[0])
        raise InputError(
            f'points repeats corner {_named(corners, i)} as corner {_number(corners, i + 1)}; '
            'give every corner once'
        )
    count = len(corners)
    low, high = np.minimum(start, end) - near, np.maximum(start, end) + near
    for i in range(count):
        # the edges after this one that may be near
        j = (
            i
            + 1
            + np.flatnonzero(np.all((low[i + 1 :] <= high[i]) & (low[i] <= high[i + 1 :]), 1))
        )
        follows, leads = j == i + 1, (i == 0) & (j == count - 1)  # and those that share a corner
        gap = np.minimum.reduce(
            [
                np.where(follows, np.inf, _distances(start[j], start[i], way[i])),
                np.where(leads, np.inf, _distances(end[j], start[i], way[i])),
                np.where(leads, np.inf, _distances(start[i], start[j], way[j])),
                np.where(follows, np.inf, _distances(end[i], start[j], way[j])),
            ]
        )
        crossing = ~follows & ~leads & _cross(start[i], end[i], start[j], end[j])
        meet = j[(gap <= near) | crossing]
        if meet.size:
            k = int(meet[0])
            raise InputError(
                f'points has edges that cross or touch: from corner {_named(corners, i)} to '
                f'{_number(corners, i + 1)} and from corner {_named(corners, k)} to '
                f'{_number(corners, k + 1)}; go round the section once, in order'
            )


def _number(corners: Array, i: int) -> int:
    return i % len(corners) + 1


def _named(corners: Array, i: int) -> str:
    y, z = corners[i]
    return f'{i + 1} ({y:g}, {z:g})'


def _distances(points: Array, start: Array, way: Array) -> Array:
    """Distances of points from segments."""
    along = np.sum((points - start) * way, axis=-1) / np.sum(way**2, axis=-1)
    away = points - start - np.clip(along, 0.0, 1.0)[..., np.newaxis] * way
    return np.asarray(np.hypot(away[..., 0], away[..., 1]))


def _cross(a: Array, b: Array, c: Array, d: Array) -> NDArray[np.bool_]:
    """Tell whether the segment from a to b crosses those from c to d."""

    def left(p: Array, q: Array, r: Array) -> NDArray[np.bool_]:
        u, v = q - p, r - p
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0] > 0.0)

    return np.asarray((left(a, b, c) != left(a, b, d)) & (left(c, d, a) != left(c, d, b)))
