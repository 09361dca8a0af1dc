"""Quadrature over the wetted walls of tanks and over the mean free surface, about O."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank import Capsule, Circle, Polygon, Rectangle, Tank, UniformTank, UprightCylinder

Array = NDArray[np.float64]

NODES = 40  # in each direction of each face
X, Y, Z = np.eye(3)


class Surface(NamedTuple):
    """Points (p, 3), normals out of the liquid (p, 3), weights (p,)."""

    points: Array
    normals: Array
    weights: Array

    def __add__(self, other: Surface) -> Surface:
        return Surface(*map(np.concatenate, zip(self, other, strict=True)))


def interval(begin: float, end: float, nodes: int = NODES) -> tuple[Array, Array]:
    """Gauss points and weights."""
    x, weight = np.polynomial.legendre.leggauss(nodes)
    return (begin + end) / 2.0 + (end - begin) / 2.0 * x, (end - begin) / 2.0 * weight


def _face(points: Array, normals: Array, weights: Array) -> Surface:
    points = points.reshape(-1, 3)
    return Surface(
        points, np.broadcast_to(normals, (*weights.shape, 3)).reshape(-1, 3), weights.ravel()
    )


def _plane(origin: Array, normal: Array, first: tuple, second: tuple) -> Surface:
    """Rectangle at the origin; first and second are a direction, an interval and its weights."""
    (e1, (u, u_weight)), (e2, (v, v_weight)) = first, second
    points = origin + u[:, None, None] * e1 + v[None, :, None] * e2
    return _face(points, normal, np.outer(u_weight, v_weight))


def _polygonal(tank: UniformTank, depth: float) -> tuple[Surface, Surface]:
    """Walls and lid of a convex section; its ends in triangles around the centroid."""
    half, x = tank.length / 2.0, interval(-tank.length / 2.0, tank.length / 2.0)
    corners = np.pad(tank.section.liquid_outline(depth), ((0, 0), (1, 0)))
    middle = corners.mean(axis=0)
    share = interval(0.0, 1.0)
    sides = {True: [], False: []}
    for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        way = end - begin
        length = np.hypot(*way[1:])
        outwards = np.cross(way, X) / length
        along = way / length, (length * share[0], length * share[1])
        sides[bool(begin[2] == end[2] == 0.0)].append(_plane(begin, outwards, (X, x), along))
        # from the middle, u of the way to the side, v along it
        u, v = (nodes[:, None] for nodes in (share[0], share[0]))
        points = middle + u[:, :, None] * (begin + v * way - middle)
        twice = np.cross(begin - middle, way)[0]
        weights = np.outer(share[1] * share[0], share[1]) * twice
        for sign in (-1.0, 1.0):
            sides[False].append(_face(points + sign * half * X, sign * X, weights))
    none = Surface(
        np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    )  # full to a top that is a point
    wall, lid = (sum(part, none) for part in (sides[False], sides[True]))
    return wall, lid


def _uniform(tank: UniformTank, depth: float) -> tuple[Surface, Surface]:
    half, section = tank.length / 2.0, tank.section
    if isinstance(section, Polygon):
        return _polygonal(tank, depth)
    x = interval(-half, half)
    b = section.moments(depth).half_width
    lid = _plane(np.zeros(3), Z, (X, x), (Y, interval(-b, b)))
    if isinstance(section, Rectangle):
        y, z = interval(-b, b), interval(-depth, 0.0)
        wall = _plane(-depth * Z, -Z, (X, x), (Y, y))
        for sign in (-1.0, 1.0):
            wall += _plane(sign * b * Y, sign * Y, (X, x), (Z, z))
            wall += _plane(sign * half * X, sign * X, (Y, y), (Z, z))
        return wall, lid
    assert isinstance(section, Circle)
    r, axis = section.radius, (section.radius - depth) * Z
    reach = np.arccos((r - depth) / r)  # from the lowest point to the contact line
    angle, angle_weight = interval(-reach, reach)
    outwards = np.sin(angle)[:, None] * Y - np.cos(angle)[:, None] * Z
    wall = _face(
        axis + r * outwards[:, None] + x[0][None, :, None] * X,
        outwards[:, None] * np.ones((NODES, 1)),
        np.outer(r * angle_weight, x[1]),
    )
    # ends in horizontal strips of half width r sin(angle), down to the lowest point
    angle, angle_weight = interval(0.0, reach)
    strip, strip_weight = interval(-1.0, 1.0)
    end = (r * np.sin(angle)[:, None] * strip)[..., None] * Y
    end = axis - (r * np.cos(angle))[:, None, None] * Z + end
    weights = np.outer((r * np.sin(angle)) ** 2 * angle_weight, strip_weight)
    for sign in (-1.0, 1.0):
        wall += _face(end + sign * half * X, sign * X, weights)
    return wall, lid


def _upright(tank: UprightCylinder, depth: float) -> tuple[Surface, Surface]:
    r, r_weight = interval(0.0, tank.radius)
    z, z_weight = interval(-depth, 0.0)
    angle = 2.0 * np.pi * np.arange(NODES) / NODES
    outwards = np.cos(angle)[:, None, None] * X + np.sin(angle)[:, None, None] * Y
    share = np.full(NODES, 2.0 * np.pi / NODES)
    wall = _face(
        tank.radius * outwards + z[None, :, None] * Z,
        outwards,
        np.outer(tank.radius * share, z_weight),
    )
    disc = r[None, :, None] * outwards
    weights = np.outer(share, r * r_weight)
    return wall + _face(disc - depth * Z, -Z, weights), _face(disc, Z, weights)


def _sphere(tank: Capsule, depth: float, down: int) -> tuple[Surface, Surface]:
    assert tank.is_sphere
    r, centre = tank.radius, (tank.radius - depth) * Z
    reach = np.arccos((r - depth) / r)  # from the lowest point to the contact line
    angle, angle_weight = interval(0.0, reach, down)
    around = 12  # enough: of one nodal diameter
    turn = 2.0 * np.pi * np.arange(around) / around
    share = np.full(around, 2.0 * np.pi / around)
    level = np.cos(turn)[:, None] * X + np.sin(turn)[:, None] * Y
    outwards = np.sin(angle)[None, :, None] * level[:, None] - np.cos(angle)[None, :, None] * Z
    wall = _face(
        centre + r * outwards, outwards, np.outer(share, r**2 * np.sin(angle) * angle_weight)
    )
    s, s_weight = interval(0.0, r * np.sin(reach))
    return wall, _face(s[None, :, None] * level[:, None], Z, np.outer(share, s * s_weight))


def wetted(tank: Tank, depth: float, down: int = NODES) -> tuple[Surface, Surface]:
    """
    Wetted walls, and the mean free surface, of a box, a prism, a cylinder or a sphere.

    Down the wall of a sphere there are so many points: high modes live at its contact line.
    """
    if isinstance(tank, UprightCylinder):
        return _upright(tank, depth)
    if isinstance(tank, Capsule):
        return _sphere(tank, depth, down)
    return _uniform(tank, depth)
