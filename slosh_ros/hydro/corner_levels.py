"""Levels at which the wall of a tank has corners: there coefficients have a kink over the fill."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slosh_ros.hydro.coefficients import Array
from slosh_ros.tank import MeshTank, Polygon, RoundedRectangle, Tank, UniformTank
from slosh_ros.tank.triangulation import corner_angles

_MOST = 40  # levels, those of the sharpest corners
_BLUNT = 0.02  # [rad] a corner that turns the wall by less is none
_NEAR = 0.01  # [heights] corners that are no farther apart make one level
_LEVEL = 1e-3  # [heights] by which the ends of a level edge may differ


class CornerLevel(NamedTuple):
    """
    A level at which the wall has a corner.

    Attributes
    ----------
    depth : float
        Above the bottom [m].
    turn : float
        Angle by which the wall turns there [rad].
    """

    depth: float
    turn: float


def corner_levels(tank: Tank) -> list[CornerLevel]:
    """Find the sharpest corners between the bottom and the roof, rising."""
    if isinstance(tank, MeshTank):
        level, turn = _edges(tank)
    elif isinstance(tank, UniformTank) and isinstance(tank.section, RoundedRectangle):
        radius = tank.section.corner_radius
        return [CornerLevel(radius, 0.0), CornerLevel(tank.height - radius, 0.0)]
    elif isinstance(tank, UniformTank) and isinstance(tank.section, Polygon):
        corners = tank.section.corners
        level, turn = corners[:, 1], np.abs(np.pi - corner_angles(corners))
    else:
        return []
    levels: list[CornerLevel] = []
    for i in np.argsort(-turn)[: np.count_nonzero(turn > _BLUNT)].tolist():
        depth = min(max(float(level[i]) + tank.height / 2.0, 0.0), tank.height)
        corner = CornerLevel(depth, float(turn[i]))
        apart = min((abs(corner.depth - other.depth) for other in levels), default=np.inf)
        if len(levels) < _MOST and apart > _NEAR * tank.height:
            levels.append(corner)
    return sorted(levels)


def _edges(tank: MeshTank) -> tuple[Array, Array]:
    """
    Levels z of a mesh's level edges [m], and the angles by which they turn the wall there [rad].

    An angle is the mean along a contact line as long as the bounding box is around.
    """
    corners = tank.vertices[tank.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = np.sort(np.stack([tank.faces, np.roll(tank.faces, -1, axis=1)], axis=2), axis=2)
    order = np.lexsort(edges.reshape(-1, 2).T)  # every edge twice, as the surface is closed
    ends = tank.vertices[edges.reshape(-1, 2)[order[::2]]]
    sides = normals[order.reshape(-1, 2) // 3]
    turn = np.arccos(np.clip(np.sum(sides[:, 0] * sides[:, 1], axis=1), -1.0, 1.0))
    way = ends[:, 1] - ends[:, 0]
    size = _LEVEL * tank.height
    flat = (np.abs(way[:, 2]) <= size) & (turn > 0.0)
    share = np.linalg.norm(way[flat, :2], axis=1) / (2.0 * tank.box[:2].sum())
    level = ends[flat, :, 2].mean(axis=1)
    if not len(level):
        return level, level
    rising = np.argsort(level)
    group = np.append(0, np.cumsum(np.diff(level[rising]) > size))
    weight = (turn[flat] * share)[rising]
    total = np.bincount(group, weight).astype(float)
    return np.bincount(group, weight * level[rising]) / total, total
