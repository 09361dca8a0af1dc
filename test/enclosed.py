"""Liquids as closed surfaces of triangles, of tanks that another route knows as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank import LiquidAtRest, Tank, cylinder_x, cylinder_z, rectangular
from slosh_ros.tank.surface import LiquidSurface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Enclosed:
    """A tank, and how its liquid is surrounded with triangles of a size at a depth."""

    tank: Tank
    surface: Callable[[float, float], LiquidSurface]

    @property
    def height(self) -> float:
        return self.tank.height

    def filled(self, depth: float) -> LiquidAtRest:
        return self.tank.filled(depth)

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        return self.surface(depth, size)


def turned(tank: Enclosed, angle: float) -> Enclosed:
    """Turn a tank about the vertical axis; its inertia is not turned with it."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def surface(depth: float, size: float) -> LiquidSurface:
        straight = tank.surface(depth, size)
        return replace(straight, wall=straight.wall @ turn, free=straight.free @ turn)

    return replace(tank, surface=surface)


def sheet(points: Array) -> Array:
    """Two triangles for each mesh of a net of points, shape (n, m, 3), normal along x times y."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    halves = (np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d)))
    return np.concatenate(list(halves))


def disc(outline: Array) -> Array:
    """Triangles from the middle of an outline, counter-clockwise from where the normal ends."""
    middle = np.broadcast_to(outline.mean(axis=0), outline.shape)
    return np.stack([middle, outline, np.roll(outline, -1, axis=0)], axis=1)


def _prism(outline: Array, length: float, size: float) -> LiquidSurface:
    """Section y, z of a trough from brim to brim, counter-clockwise from the front."""
    x = np.linspace(length / 2.0, -length / 2.0, int(np.ceil(length / size)) + 1)
    net = np.empty((len(x), len(outline), 3))
    net[..., 0], net[..., 1:] = x[:, np.newaxis], outline
    front, back = disc(net[0]), disc(net[-1])[:, ::-1]
    return LiquidSurface(np.concatenate([sheet(net), front, back]), sheet(net[:, [-1, 0]]))


def box(length: float, width: float, height: float) -> Enclosed:
    def surface(depth: float, size: float) -> LiquidSurface:
        y = width / 2.0 * np.array([-1.0, -1.0, 1.0, 1.0])
        return _prism(
            np.stack([y, depth * np.array([0.0, -1.0, -1.0, 0.0])], axis=-1), length, 3.0
        )

    return Enclosed(rectangular(length, width, height), surface)


def pipe(radius: float, length: float) -> Enclosed:
    def surface(depth: float, size: float) -> LiquidSurface:
        reach = np.arccos(1.0 - depth / radius)
        angle = np.linspace(-reach, reach, 2 * int(np.ceil(reach * radius / size)) + 1)
        outline = radius * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
        outline[:, 1] += radius - depth
        outline[[0, -1], 1] = 0.0
        return _prism(outline, length, size)

    return Enclosed(cylinder_x(radius, length), surface)


def drum(radius: float, height: float, sides: int = 4) -> Enclosed:
    """Upright cylinder; the triangles are symmetric if the number of sides is divided by 4."""

    def surface(depth: float, size: float) -> LiquidSurface:
        corners = sides * int(np.ceil(2.0 * np.pi * radius / size / sides))
        angle = 2.0 * np.pi * np.arange(corners + 1) / corners
        ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        ring[-1] = ring[0]
        z = np.linspace(-depth, 0.0, int(np.ceil(depth / size)) + 1)
        net = np.empty((len(ring), len(z), 3))
        net[..., :2], net[..., 2] = ring[:, np.newaxis], z
        bottom, lid = disc(net[:-1, 0])[:, ::-1], disc(net[:-1, -1])
        return LiquidSurface(np.concatenate([sheet(net), bottom]), lid)

    return Enclosed(cylinder_z(radius, height), surface)
