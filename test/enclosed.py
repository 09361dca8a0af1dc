"""Liquids as closed surfaces of triangles, of tanks that another route knows as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slosh_ros.study.enclosed import Enclosed as Surrounded
from slosh_ros.tank import LiquidAtRest, Rectangle, Tank, UniformTank
from slosh_ros.tank.surface import LiquidSurface


@dataclass(frozen=True)
class Enclosed:
    """A tank, and how its liquid is surrounded with triangles of a size at a depth."""

    tank: Tank
    surface: Callable[[float, float], LiquidSurface]

    @staticmethod
    def of(tank: Tank) -> Enclosed:
        """Surround a tank as `slosh modes --compare` does; flat walls by few triangles."""
        surrounded = Surrounded.of(tank)
        assert surrounded is not None
        whole = surrounded.liquid_surface
        if isinstance(tank, UniformTank) and isinstance(tank.section, Rectangle):
            return Enclosed(tank, lambda depth, _: whole(depth, tank.length))
        return Enclosed(tank, whole)

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
