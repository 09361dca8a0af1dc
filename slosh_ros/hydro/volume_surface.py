"""A mean free surface of any outline: points on it, and mode shapes told apart by them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.hydro.coefficients import Array, mode_name, peaks

_LATTICE = 65  # points along each side of the box around it; odd, so that the middle is among them
_RINGS, _AROUND = 20, 96  # of points; a multiple of 8 around: middle lines, and corners of boxes
_RIM = 12  # times as many on the outline: where it has corners, so may crests
_CREST = 0.3  # [max |f|] how high the first crest stands that settles the sign
_ROUNDING = 1e-9
_WAVE = 0.05  # [max |f|] below which a shape has no sign


@dataclass(frozen=True, eq=False)
class FreeSurface:
    """
    Points on a mean free surface.

    Attributes
    ----------
    points : array, shape (m, 2)
        Points x, y of rings around O, the last on the outline [m]. There are as many on every
        surface, and each has its like on another one: modes of two fills are compared by them.
        What would be dry is moved to the outline.
    rim : array, shape (q, 2)
        Points on the outline alone, more of them [m].
    lattice : array, shape (k, k, 2)
        Points x, y of a lattice on the box around it, x by rows [m].
    inside : array of bool, shape (k, k)
        Which of these are within the outline.
    gaps : tuple of (float, float)
        From which y to which y there is a wall between pieces [m].
    """

    points: Array
    rim: Array
    lattice: Array
    inside: NDArray[np.bool_]
    gaps: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(cls, triangles: Array) -> FreeSurface:
        """
        Sample a surface.

        Parameters
        ----------
        triangles : array, shape (n, 3, 3)
            Their corners, counter-clockwise [m].
        """
        edges = outline(triangles)
        rim = edges.reshape(-1, 2)
        low, high = rim.min(axis=0), rim.max(axis=0)
        x, y = (np.linspace(a, b, _LATTICE) for a, b in zip(low, high, strict=True))
        lattice = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1)
        # not on the box itself, where outlines end
        within = lattice + 1e-6 * ((low + high) / 2.0 - lattice)
        inside = _within(within.reshape(-1, 2), edges).reshape(lattice.shape[:2])
        rim = _rim(edges, (high - low) / 2.0)
        return cls(_rings(edges, rim[::_RIM]), rim, lattice, inside, _gaps(edges))

    @property
    def extent(self) -> tuple[float, float]:
        """Greatest length along x and along y [m]."""
        length, width = np.ptp(self.lattice.reshape(-1, 2), axis=0)
        return float(length), float(width)

    def highest(self, shapes: Array, on_rim: Array) -> Array:
        """
        Largest modulus of each mode, shape (n,).

        Parameters
        ----------
        shapes : array, shape (m, n)
            At all points.
        on_rim : array, shape (q, n)
            At those of the rim.
        """
        middle = np.broadcast_to(shapes[:1], (_AROUND, shapes.shape[1]))
        rays = np.stack([middle, *shapes[1:].reshape(_RINGS, _AROUND, -1)])
        within = peaks(rays.reshape(len(rays), -1)).reshape(_AROUND, -1).max(axis=0)
        closed = np.concatenate([on_rim, on_rim[:1]])
        return np.asarray(np.maximum(within, peaks(closed)))

    def signs(self, shapes: Array) -> Array:
        """
        Sign that makes the first crest or trough from -x, -y a crest.

        Parameters
        ----------
        shapes : array, shape (m, n)
            At all points, scaled to max |f| = 1.
        """
        order = np.argsort(self.points.sum(axis=1), kind='stable')
        first = order[np.argmax(np.abs(shapes[order]) >= _CREST, axis=0)]
        return np.asarray(np.sign(shapes[first, np.arange(shapes.shape[1])]))

    def names(
        self, shapes: Array, odd: NDArray[np.bool_], symmetric: tuple[bool, bool]
    ) -> tuple[str, ...]:
        """
        Name modes by their half-waves along x and along y, each name once.

        Parameters
        ----------
        shapes : array, shape (m, n)
            At the points of the lattice that are inside.
        odd : array of bool, shape (n, 2)
            Whether they are odd in x and in y, or more so than even.
        symmetric : tuple of bool
            Whether they are exactly odd or even.
        """
        taken: list[tuple[int, int]] = []
        for shape, is_odd in zip(shapes.T, odd, strict=True):
            values = np.full(self.inside.shape, np.nan)
            values[self.inside] = shape
            waves = [
                _half_waves(_line(values if along == 0 else values.T, is_odd[1 - along]))
                for along in range(2)
            ]
            for k in range(2):
                waves[k] += int(symmetric[k] and waves[k] % 2 != is_odd[k])
            step = 0 if is_odd[0] or not is_odd[1] else 1
            if waves == [0, 0]:
                waves[step] = 1
            while (waves[0], waves[1]) in taken:
                waves[step] += 1 + int(symmetric[step])
            taken.append((waves[0], waves[1]))
        return tuple(mode_name(a, b) for a, b in taken)


def _line(values: Array, odd_across: bool) -> Array:
    """Values along the first axis, in the middle or, if they are zero there, on the rim."""
    if not odd_across:
        line = values[:, values.shape[1] // 2]
    else:
        upper = values.shape[1] - 1 - np.argmax(~np.isnan(values[:, ::-1]), axis=1)
        line = values[np.arange(len(values)), upper]
    return np.asarray(line[~np.isnan(line)])


def _half_waves(line: Array) -> int:
    """Count changes of sign."""
    signs = np.sign(line[np.abs(line) > _WAVE * np.abs(line).max(initial=1e-300)])
    return int(np.count_nonzero(np.diff(signs)))


def outline(triangles: Array) -> Array:
    """Edges that belong to one triangle only, in its sense of rotation, shape (e, 2, 2)."""
    corners, number = np.unique(
        np.round(triangles[:, :, :2].reshape(-1, 2), 9), axis=0, return_inverse=True
    )
    number = number.reshape(-1, 3)
    edges = np.concatenate([number[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = edges[edges[:, 0] != edges[:, 1]]
    _, first, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(corners[edges[first[count == 1]]])


def _within(points: Array, edges: Array) -> NDArray[np.bool_]:
    """Tell which points have an odd number of edges on their right."""
    (x0, y0), (x1, y1) = edges.transpose(1, 2, 0)
    x, y = points.T[..., np.newaxis]
    rising = np.where(y1 == y0, 1.0, y1 - y0)
    crossing = ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / rising)
    return np.asarray(crossing.sum(axis=1) % 2 == 1)


def likeness(ours: Array, theirs: Array) -> Array:
    """
    How much shapes are alike, -1 to 1.

    Parameters
    ----------
    ours : array, shape (m, n)
        At the points of a free surface.
    theirs : array, shape (m, k)
        At those of the same or of another one.

    Returns
    -------
    array, shape (n, k)
        Cosines of the angles between them.
    """
    area = np.append(0.0, np.repeat(np.arange(1.0, _RINGS + 1.0), _AROUND))[:, np.newaxis]
    area[-_AROUND:] /= 2.0
    a, b = (part / np.sqrt(np.sum(area * part**2, axis=0)) for part in (ours, theirs))
    return np.asarray(a.T @ (area * b))


def _gaps(edges: Array) -> tuple[tuple[float, float], ...]:
    """Intervals of y between those of the outlines of pieces, which are closed."""
    side = np.sort(edges[:, :, 1], axis=1)
    begin, end = side[np.argsort(side[:, 0])].T
    so_far = np.maximum.accumulate(end)[:-1]
    apart = begin[1:] > so_far + _ROUNDING
    return tuple(zip(so_far[apart].tolist(), begin[1:][apart].tolist(), strict=True))


def _rim(edges: Array, half: Array) -> Array:
    """Points of the outline that are seen from O, the farthest in each direction, shape (q, 2)."""
    angle = 2.0 * np.pi * np.arange(_RIM * _AROUND) / (_RIM * _AROUND)
    ray = half * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    begin, way = edges[:, 0], edges[:, 1] - edges[:, 0]

    def cross(a: Array, b: Array) -> Array:
        return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

    # begin + share way = reach ray
    across = cross(ray[:, np.newaxis], way)
    safe = np.where(across == 0.0, np.inf, across)
    share, reach = cross(begin, ray[:, np.newaxis]) / safe, cross(begin, way) / safe
    hit = (share >= -_ROUNDING) & (share <= 1.0 + _ROUNDING)
    rim = np.where(hit, reach, 0.0).max(axis=1, initial=0.0)[:, np.newaxis] * ray
    unseen = ~rim.any(axis=1)
    rim[unseen] = _nearest(rim[unseen], begin, way)
    return np.asarray(rim)


def _rings(edges: Array, rim: Array) -> Array:
    """Points of rings between O and the outline, O first, shape (m, 2)."""
    inner = np.linspace(0.0, 1.0, _RINGS + 1)[1:-1, np.newaxis, np.newaxis] * rim
    inner = np.concatenate([np.zeros((1, 2)), inner.reshape(-1, 2)])
    dry = ~_within(inner, edges)
    inner[dry] = _nearest(inner[dry], edges[:, 0], edges[:, 1] - edges[:, 0])
    return np.concatenate([inner, rim])


def _nearest(points: Array, begin: Array, way: Array) -> Array:
    """Nearest points on edges."""
    share = np.sum((points[:, np.newaxis] - begin) * way, axis=2) / np.sum(way**2, axis=1)
    feet = begin + np.clip(share, 0.0, 1.0)[..., np.newaxis] * way
    away = np.sum((feet - points[:, np.newaxis]) ** 2, axis=2)
    return np.asarray(feet[np.arange(len(points)), away.argmin(axis=1)])
