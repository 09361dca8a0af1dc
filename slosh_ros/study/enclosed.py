"""Tanks that have a route of their own, as closed surfaces of triangles for the 3-D route."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank import (
    LiquidAtRest,
    Polygon,
    SymmetricSection,
    Tank,
    UniformTank,
    UprightCylinder,
)
from slosh_ros.tank.surface import LiquidSurface
from slosh_ros.tank.triangulation import triangulate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Enclosed:
    """
    A tank of one section along x, or an upright cylinder, whose liquid is surrounded.

    Parameters
    ----------
    tank : UniformTank or UprightCylinder
        The tank.
    """

    tank: UniformTank | UprightCylinder

    @staticmethod
    def of(tank: Tank) -> Enclosed | None:
        """Surround a tank; None if it is of another kind."""
        if isinstance(tank, UprightCylinder) or (
            isinstance(tank, UniformTank) and isinstance(tank.section, SymmetricSection | Polygon)
        ):
            return Enclosed(tank)
        return None

    def filled(self, depth: float) -> LiquidAtRest:
        """Describe the liquid at rest."""
        return self.tank.filled(depth)

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        """
        Surround the liquid with triangles, their corners on the wall.

        Parameters
        ----------
        depth : float
            Of the liquid [m].
        size : float
            Of the triangles, about [m].
        """
        if isinstance(self.tank, UprightCylinder):
            return _drum(self.tank.radius, depth, size)
        section = self.tank.section
        if isinstance(section, Polygon):
            return _prism(section.liquid_outline(depth), self.tank.length)
        assert isinstance(section, SymmetricSection)
        fine = section.wall(depth, np.linspace(0.0, 1.0, 2001))
        length = float(np.linalg.norm(np.diff(fine), axis=0).sum())
        pieces = np.linspace(0.0, 1.0, max(int(np.ceil(length / size)), 2) + 1)
        places = np.unique(np.concatenate([pieces, section.corners(depth)]))
        right = section.wall(depth, places).T
        right[0, 1], right[-1, 0] = 0.0, 0.0
        outline = np.concatenate([right * [-1.0, 1.0], right[-2::-1]])
        x = self.tank.length * np.linspace(0.5, -0.5, int(np.ceil(self.tank.length / size)) + 1)
        net = np.empty((len(x), len(outline), 3))
        net[..., 0], net[..., 1:] = x[:, np.newaxis], outline
        ends = _disc(net[0]), _disc(net[-1])[:, ::-1]
        return LiquidSurface(np.concatenate([_sheet(net), *ends]), _sheet(net[:, [-1, 0]]))


def _prism(outline: Array, length: float) -> LiquidSurface:
    points, triangles = triangulate(outline, None)
    front = np.insert(points, 0, length / 2.0, axis=1)[triangles]
    line = np.concatenate([outline, outline[:1]])
    net = np.stack([np.insert(line, 0, x, axis=1) for x in (length / 2.0, -length / 2.0)])
    is_free = (line[:-1, 1] == 0.0) & (line[1:, 1] == 0.0)
    back = front[:, ::-1] * [-1.0, 1.0, 1.0]
    wall, free = [front, back], [np.zeros((0, 3, 3))]
    for i, on_top in enumerate(is_free.tolist()):
        (free if on_top else wall).append(_sheet(net[:, i : i + 2]))
    return LiquidSurface(np.concatenate(wall), np.concatenate(free))


def _drum(radius: float, depth: float, size: float) -> LiquidSurface:
    corners = 4 * int(np.ceil(np.pi * radius / size / 2.0))  # symmetric about both planes
    angle = 2.0 * np.pi * np.arange(corners + 1) / corners
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ring[-1] = ring[0]
    z = np.linspace(-depth, 0.0, int(np.ceil(depth / size)) + 1)
    net = np.empty((len(ring), len(z), 3))
    net[..., :2], net[..., 2] = ring[:, np.newaxis], z
    bottom, lid = _disc(net[:-1, 0])[:, ::-1], _disc(net[:-1, -1])
    return LiquidSurface(np.concatenate([_sheet(net), bottom]), lid)


def _sheet(points: Array) -> Array:
    """Split each mesh of a net of points, (n, m, 3), in two; normal along first times second."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    halves = (np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d)))
    return np.concatenate(list(halves))


def _disc(outline: Array) -> Array:
    """Fan from the middle of an outline, counter-clockwise from where the normal ends."""
    middle = np.broadcast_to(outline.mean(axis=0), outline.shape)
    return np.stack([middle, outline, np.roll(outline, -1, axis=0)], axis=1)
