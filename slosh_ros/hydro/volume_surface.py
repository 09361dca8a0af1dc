"""A mean free surface of any outline: points on it, and mode shapes told apart by them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.hydro.coefficients import Array, mode_name

_LATTICE = 65  # points along each side of the box around it; odd, so that the middle is among them
_RIM = 192  # points on the outline, about
_CREST = 0.3  # [max |f|] how high the first crest stands that settles the sign
_WAVE = 0.05  # [max |f|] below which a shape has no sign


@dataclass(frozen=True, eq=False)
class FreeSurface:
    """
    Points on a mean free surface.

    Attributes
    ----------
    rim : array, shape (q, 2)
        Points x, y on the outline [m].
    lattice : array, shape (k, k, 2)
        Points x, y of a lattice on the box around it, x by rows [m].
    inside : array of bool, shape (k, k)
        Which of these are within the outline.
    """

    rim: Array
    lattice: Array
    inside: NDArray[np.bool_]

    @classmethod
    def of(cls, triangles: Array) -> FreeSurface:
        """
        Sample a surface.

        Parameters
        ----------
        triangles : array, shape (n, 3, 3)
            Their corners, counter-clockwise [m].
        """
        edges = _outline(triangles)
        rim = edges.reshape(-1, 2)
        low, high = rim.min(axis=0), rim.max(axis=0)
        x, y = (np.linspace(a, b, _LATTICE) for a, b in zip(low, high, strict=True))
        lattice = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1)
        # not on the box itself, where outlines end
        within = lattice + 1e-6 * ((low + high) / 2.0 - lattice)
        inside = _within(within.reshape(-1, 2), edges).reshape(lattice.shape[:2])
        return cls(_spread(edges), lattice, inside)

    @property
    def extent(self) -> tuple[float, float]:
        """Greatest length along x and along y [m]."""
        length, width = np.ptp(self.lattice.reshape(-1, 2), axis=0)
        return float(length), float(width)

    @property
    def points(self) -> Array:
        """All points on the surface, shape (m, 2) [m]."""
        return np.concatenate([self.lattice[self.inside], self.rim])

    @property
    def sparse(self) -> NDArray[np.bool_]:
        """Tell which of the points make a lattice half as dense, with the outline; shape (m,)."""
        half = np.zeros_like(self.inside)
        half[::2, ::2] = True
        return np.append(half[self.inside], np.ones(len(self.rim), dtype=bool))

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
            At all points.
        odd : array of bool, shape (n, 2)
            Whether they are odd in x and in y, or more so than even.
        symmetric : tuple of bool
            Whether they are exactly odd or even.
        """
        taken: list[tuple[int, int]] = []
        for shape, is_odd in zip(shapes.T, odd, strict=True):
            values = np.full(self.inside.shape, np.nan)
            values[self.inside] = shape[: self.inside.sum()]
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


def _outline(triangles: Array) -> Array:
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


def _spread(edges: Array) -> Array:
    """Points on the outline at about even distances, corners of long edges among them."""
    begin, end = edges.transpose(1, 0, 2)
    length = np.linalg.norm(end - begin, axis=1)
    spacing = length.sum() / _RIM
    pieces = [
        a + np.linspace(0.0, 1.0, int(np.ceil(size / spacing)), endpoint=False)[:, np.newaxis]
        * (b - a)
        for a, b, size in zip(begin, end, length, strict=True)
    ]  # fmt: skip
    points = np.concatenate(pieces)
    return points[:: max(1, len(points) // (2 * _RIM))]
