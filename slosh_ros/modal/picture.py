"""
The free surface and the tank as triangles and lines, for pictures.

A wave changes the heights of the surface's points only; where walls are not upright its edge
stands where it is at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from slosh_ros.hydro import ModalCoefficients
from slosh_ros.tank import Tank, UniformTank, UprightCylinder

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

POINTS = 300  # of a surface, about: more make its message dear and the picture no better
_APART = 0.8 / POINTS**0.5  # of the surface's length and width
_SLIVER = 1e-9  # of its area: triangles of points on a line
_OUTLINE_POINTS = 17  # on either half of a curved section
# viridis at equal steps: perceptually uniform, and told apart by colour-blind eyes
# (van der Walt & Smith 2015, matplotlib)
_COLOURS = np.array(
    [
        (0.267004, 0.004874, 0.329415), (0.282327, 0.094955, 0.417331),
        (0.278826, 0.175490, 0.483397), (0.258965, 0.251537, 0.524736),
        (0.229739, 0.322361, 0.545706), (0.199430, 0.387607, 0.554642),
        (0.172719, 0.448791, 0.557885), (0.149039, 0.508051, 0.557250),
        (0.127568, 0.566949, 0.550556), (0.120638, 0.625828, 0.533488),
        (0.157851, 0.683765, 0.501686), (0.246070, 0.738910, 0.452024),
        (0.369214, 0.788888, 0.382914), (0.515992, 0.831158, 0.294279),
        (0.678489, 0.863742, 0.189503), (0.845561, 0.887322, 0.099702),
        (0.993248, 0.906157, 0.143936),
    ]
)  # fmt: skip


def colours(values: Array) -> Array:
    """Red, green, blue of values between -1 (trough) and 1 (crest), shape (n, 3); beyond: ends."""
    place = np.linspace(-1.0, 1.0, len(_COLOURS))
    return np.stack([np.interp(values, place, column) for column in _COLOURS.T], axis=-1)


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """
    The mean free surface in triangles.

    Attributes
    ----------
    points : array, shape (m, 3)
        In the tank frame [m]; the edge among them.
    shapes : array, shape (m, n)
        The mode shapes f_j there.
    triangles : array, shape (k, 3)
        Indices of corners, counter-clockwise seen from above.
    """

    points: Array
    shapes: Array
    triangles: Indices

    @classmethod
    def of(cls, coefficients: ModalCoefficients) -> SurfaceMesh:
        """Take the surface of a liquid; it is empty if nothing sloshes or its plan is unknown."""
        c = coefficients
        plane = c.surface_points
        walls = [sum(gap) / 2.0 for gap in c.surface_gaps]  # between the pieces of the surface
        piece = np.searchsorted(walls, plane[:, 1])
        chosen, triangles, count = [], [], 0
        for k in range(len(walls) + 1 if len(c.omega) and len(plane) else 0):
            own = np.flatnonzero(piece == k)
            if len(own) > POINTS:
                own = own[_thinned(plane[own])]
            chosen.append(own)
            triangles.append(_triangles(plane[own]) + count)
            count += len(own)
        keep = np.concatenate([np.zeros(0, dtype=np.intp), *chosen])
        flat = np.column_stack([plane[keep], np.zeros(len(keep))])
        return cls(
            points=flat + c.liquid.surface_centre,
            shapes=c.surface_shapes[keep],
            triangles=np.concatenate([np.zeros((0, 3), dtype=np.intp), *triangles]),
        )

    def elevation(self, beta: Array) -> Array:
        """Height of the wave at the points, shape (m,) [m]."""
        return np.asarray(self.shapes @ beta)


def _triangles(plane: Array) -> Indices:
    """Join the points x, y of one piece of surface, counter-clockwise."""
    size = np.ptp(plane, axis=0)
    found = Delaunay((plane - plane.mean(axis=0)) / size).simplices.astype(np.intp)
    (ax, ay), (bx, by) = ((plane[found[:, k]] - plane[found[:, 0]]).T for k in (1, 2))
    area = ax * by - ay * bx
    found[area < 0.0] = found[area < 0.0][:, ::-1]
    return np.asarray(found[np.abs(area) > _SLIVER * size.prod()])


def _thinned(plane: Array) -> Indices:
    """Choose about `POINTS` points that cover a piece of surface evenly, its edge first."""
    triangles = _triangles(plane)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, count = np.unique(edges, axis=0, return_counts=True)
    unit = (plane - plane.min(axis=0)) / np.ptp(plane, axis=0)
    # corners before sides: nothing near a corner must displace it
    corners = [np.argmax(unit @ way) for way in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    order = [*corners, *np.unique(sides[count == 1]), *range(len(plane))]
    chosen: list[int] = []
    for i in order:
        away = np.sum((unit[chosen] - unit[i]) ** 2, axis=1)
        if away.min(initial=np.inf) >= _APART**2:
            chosen.append(int(i))
    return np.array(sorted(chosen), dtype=np.intp)


def tank_lines(tank: Tank) -> Array:
    """Outline a tank: ends of pieces of line in the tank frame, shape (k, 2, 3) [m]."""
    if isinstance(tank, UniformTank):
        end = tank.length / 2.0
        section = tank.section.outline(_OUTLINE_POINTS)
        front, back = (np.insert(section, 0, x, axis=1) for x in (end, -end))
    elif isinstance(tank, UprightCylinder):
        turn = np.linspace(0.0, 2.0 * np.pi, 2 * _OUTLINE_POINTS, endpoint=False)
        disc = tank.radius * np.column_stack([np.cos(turn), np.sin(turn)])
        front, back = (np.insert(disc, 2, z * tank.height / 2.0, axis=1) for z in (1.0, -1.0))
    else:
        along, across = tank.outlines()
        loops = [np.insert(along, 1, 0.0, axis=1), np.insert(across, 0, 0.0, axis=1)]
        return np.concatenate([np.stack([x, np.roll(x, -1, axis=0)], axis=1) for x in loops])
    rims = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (front, back)]
    return np.concatenate([*rims, np.stack([front, back], axis=1)])
