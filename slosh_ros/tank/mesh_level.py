"""
The volume of a closed surface of triangles below a level, without a cut.

It is the integral of z - level over the wall below, along z: the free surface adds nothing. Over a
triangle, the height is spread as by a hat that rises from the lowest corner to the middle one and
falls to the highest. So all is closed form, a cubic of the level between two corners.
"""

from __future__ import annotations

import numpy as np

from slosh_ros.tank.surface import Array, area_vectors


class VolumeBelow:
    """
    Tells the volume below levels of a closed surface.

    Parameters
    ----------
    triangles : array, shape (n, 3, 3)
        Their corners, normals outwards [m].
    """

    def __init__(self, triangles: Array) -> None:
        area = area_vectors(triangles)[:, 2]
        z = np.sort(triangles[area != 0.0, :, 2], axis=1)
        order = np.argsort(z[:, 2])  # by the highest corner
        self._low, self._middle, self._high = z[order].T
        self._area = area[area != 0.0][order]
        mean = z[order].mean(axis=1)
        self._mean = mean
        # of all triangles up to one, integrals of 1 and z
        self._flat = np.append(0.0, np.cumsum(self._area))
        self._first = np.append(0.0, np.cumsum(self._area * mean))

    def at(self, level: float) -> float:
        """Volume below a level [m^3]."""
        whole = int(np.searchsorted(self._high, level, side='right'))
        partly = whole + np.flatnonzero(self._low[whole:] < level)
        low, middle, high = (z[partly] for z in (self._low, self._middle, self._high))
        # of the mean of level - z below the level: up to the middle corner, and beyond
        rising = level <= middle
        end, way = np.where(rising, low, high), np.where(rising, level - low, high - level)
        part = way**3 / (3.0 * np.abs(middle - end) * (high - low))
        part += np.where(rising, 0.0, level - self._mean[partly])
        below = level * self._flat[whole] - self._first[whole] + self._area[partly] @ part
        return -float(below)
