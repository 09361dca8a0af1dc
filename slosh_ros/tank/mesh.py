"""Tanks of any shape: the inner surface in triangles, and the liquid at rest in them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from slosh_ros.errors import InputError
from slosh_ros.tank.level import depth_for
from slosh_ros.tank.mesh_check import Indices, checked, winding
from slosh_ros.tank.mesh_cut import ROUNDING, Cut, cut_below
from slosh_ros.tank.mesh_level import VolumeBelow
from slosh_ros.tank.mesh_refine import refined, split_edges
from slosh_ros.tank.polygon import outline_moments
from slosh_ros.tank.surface import (
    Array,
    LiquidSurface,
    liquid_at_rest,
    solid_moments,
)
from slosh_ros.tank.triangulation import inside, triangulate
from slosh_ros.tank.uniform import LiquidAtRest, box_outline

SUFFIXES = ('.stl', '.obj', '.ply')
_PINHOLE = 1e-5  # [bounding boxes] a smaller free surface is none
_FREE = 400  # squares of triangles' sides that are enough for a free surface
_MANY = 500  # corners of the contact line
_CENTRED = 1e-6  # [sizes] by which the centre of a file's bounding box may be off its origin


@dataclass(frozen=True, eq=False)
class MeshTank:
    """
    A tank whose inner surface is given as triangles; made by :func:`mesh`.

    The tank frame has the axes of the file, x forward, y left, z up, and its origin at the centre
    of the inner bounding box, whatever the fill and whatever the origin of the file.

    Attributes
    ----------
    vertices : array, shape (n, 3)
        Corners in the tank frame [m].
    faces : array of int, shape (m, 3)
        Of the triangles, normals out of the tank.
    repairs : tuple of str
        What has been done to the surface of the file, in words.
    """

    vertices: Array
    faces: Indices
    repairs: tuple[str, ...] = ()

    @property
    def shape(self) -> str:
        """Name of the shape, as in the configuration."""
        return 'mesh'

    @cached_property
    def volume(self) -> float:
        """Volume of the whole tank [m^3]."""
        return solid_moments(self.vertices[self.faces]).whole

    @cached_property
    def _below(self) -> VolumeBelow:
        return VolumeBelow(self.vertices[self.faces])

    @cached_property
    def box(self) -> Array:
        """Length, width and height of the bounding box, shape (3,) [m]."""
        return np.asarray(np.ptp(self.vertices, axis=0))

    @property
    def height(self) -> float:
        """Inner height [m]."""
        return float(self.box[2])

    def fill_ratio(self, depth: float) -> float:
        """Fraction of the volume that a liquid of the given greatest depth [m] takes."""
        if depth >= self.height:
            return 1.0
        return self._below.at(depth - self.height / 2.0) / self.volume

    def depth(self, fill_ratio: float) -> float:
        """Greatest depth [m] at which the liquid takes this fraction (0..1) of the volume."""
        return depth_for(self.fill_ratio, self.height, fill_ratio)

    def _cut(self, depth: float) -> Cut:
        return cut_below(self.vertices, self.faces, depth - self.height / 2.0)

    def _one_pool(self, depth: float) -> Cut:
        """
        Cut the tank at the surface of the liquid.

        Raises
        ------
        InputError
            If the liquid lies in several pools, or reaches the surface through a pinhole.
        """
        cut = self._cut(depth)
        level = f'filled to {self.fill_ratio(depth):.2%}, {depth:g} m deep,'
        if cut.pools > 1:
            raise InputError(
                f'{level} the mesh has {cut.pools} pools that are not connected; write a tank for '
                'each, or another fill'
            )
        if cut.surface[0] < _PINHOLE * self.box[0] * self.box[1]:
            raise InputError(
                f'{level} the mesh has a free surface of only {cut.surface[0]:.2g} m^2; write a '
                'slightly different fill'
            )
        return cut

    def filled(self, depth: float) -> LiquidAtRest:
        """
        Describe the liquid at rest.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.

        Raises
        ------
        InputError
            If the liquid is neither one body with a free surface nor fills the tank.
        """
        if depth == 0.0:
            return LiquidAtRest.none(self.height)
        is_full = depth == self.height
        cut = self._cut(depth) if is_full else self._one_pool(depth)
        centre = _centre(cut)
        moments = sum(
            (outline_moments(outline - centre[:2]) for outline in cut.outlines), start=np.zeros(6)
        )
        liquid = liquid_at_rest(
            solid_moments(cut.points[cut.wall] - centre),
            moments[[3, 4, 4, 5]].reshape(2, 2),
            depth=depth,
            fill_ratio=self.fill_ratio(depth),
            surface_centre=np.array([*centre[:2], depth - self.height / 2.0]),
            freeboard=self.height - depth,
        )
        return liquid.enclosed() if is_full else liquid

    def nearest(self, depth: float, point: Array) -> Array:
        """
        Find the point of the liquid at rest that is nearest to a given one.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.
        point : array, shape (3,)
            In the tank frame [m].

        Returns
        -------
        array, shape (3,)
            In the tank frame [m]; the given point itself if it is in the liquid.
        """
        level = np.array([0.0, 0.0, depth - self.height / 2.0])
        cut, above = self._cut(depth), float(point[2] - level[2])
        if above <= 0.0 and winding(point[np.newaxis], self.vertices[self.faces])[0] > 0.5:
            return point
        feet = _feet(point - level, cut.points[cut.wall])
        if above > 0.0 and cut.loops and inside(cut.outlines, point[np.newaxis, :2])[0]:
            feet = np.vstack([feet, [*point[:2], 0.0]])
        away = np.sum((feet - (point - level)) ** 2, axis=1)
        return np.asarray(level + feet[np.argmin(away)])

    def outlines(self) -> tuple[Array, Array]:
        """Return the outlines in the planes x, z and y, z of the tank frame, each (k, 2) [m]."""
        return self._outline([0, 2, 1]), self._outline([1, 2, 0])

    def _outline(self, axes: list[int]) -> Array:
        """Outline in the plane of the first two axes: the longest loop there."""
        loops = cut_below(self.vertices[:, axes], self.faces, 0.0).outlines
        sides = [float(np.ptp(loop, axis=0).sum()) for loop in loops]
        return loops[int(np.argmax(sides))] if loops else box_outline(*self.box[axes[:2]])

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        """
        Cover the liquid with triangles; the wall is that of the mesh, exactly.

        Where its triangles are larger, they are divided, unless they become very many; smaller
        ones stay as they are. Those of the free surface, which is flat, are so large that a
        thousand or two are enough; if the contact line has very many corners, or some very close
        to each other, they are any that join these.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.
        size : float
            Length of their edges, more or less [m].

        Raises
        ------
        InputError
            If the liquid lies in several pools, or the mesh has details far too small.
        """
        is_full = depth == self.height
        cut = self._cut(depth) if is_full else self._one_pool(depth)
        corners = cut.points[np.unique(cut.wall)]
        points, wall, loops = refined(cut.points, cut.wall, cut.loops, size)
        cut = Cut(points, wall, loops, np.zeros(len(wall), dtype=np.intp))
        wide = max(size, float(np.sqrt(cut.surface[0] / _FREE)))

        def sides(at: Array) -> Array:
            return np.full(len(at), wide)

        free = [np.zeros((0, 3, 3))]
        parts: dict[tuple[int, int], list[Array]] = {}
        for outer, holes in cut.pieces:
            rings = [cut.loops[i] for i in (outer, *holes)]
            rim, *within = (points[ring, :2] for ring in rings)
            try:
                few = sum(map(len, rings)) < _MANY
                flat, triangles = triangulate(rim, sides if few else None, within)
            except InputError:  # corners far closer to each other than triangles are wide
                flat, triangles = triangulate(rim, None, within)
            level = np.pad(flat, ((0, 0), (0, 1)))
            free.append(level[triangles])
            number = np.concatenate(rings).tolist()
            for (a, b), inner in _edge_parts(triangles, len(number)).items():
                parts[number[a], number[b]] = list(level[inner])
        centre = _centre(cut)
        return LiquidSurface(
            split_edges(points, wall, parts) - centre,
            np.concatenate(free) - centre,
            corners - centre,
        )


def mesh(mesh_file: str, mesh_scale: float = 1.0) -> MeshTank:
    """
    Tank of any shape, its inner surface read from a file.

    Parameters
    ----------
    mesh_file : str
        STL, OBJ or PLY; x forward, y left, z up, from any origin.
    mesh_scale : float
        Length of the file's unit [m]; 0.001 for millimetres.

    Raises
    ------
    InputError
        If the file cannot be read, or is not the inner surface of one tank.
    """
    path = Path(mesh_file)
    vertices, faces = _read(path)
    try:
        sound = checked(vertices * mesh_scale, faces)
    except InputError as error:
        raise InputError(f'mesh_file {path} {error}') from error
    low, high = sound.vertices.min(axis=0), sound.vertices.max(axis=0)
    centre, repairs = (low + high) / 2.0, sound.repairs
    if np.abs(centre).max() > _CENTRED * float((high - low).max()):
        where = ', '.join(f'{x:.6g}' for x in centre)
        repairs += (f"the origin of the tank frame is at ({where}) m of the file's axes",)
    return MeshTank(sound.vertices - centre, sound.faces, repairs)


def _read(path: Path) -> tuple[Array, Indices]:
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f'mesh_file is {path}; its ending must be {", ".join(SUFFIXES)}')
    if not path.is_file():
        raise InputError(f'mesh_file is {path}, but there is no such file')
    try:
        import trimesh
    except ImportError as error:
        raise InputError(
            'mesh_file needs the package trimesh, which is not installed; pip install trimesh'
        ) from error
    try:
        loaded: Any = trimesh.load(path, force='mesh', process=False, skip_materials=True)
        vertices, faces = np.array(loaded.vertices), np.array(loaded.faces)
    except Exception as error:  # whatever its readers raise on a file that is none
        raise InputError(
            f'mesh_file {path} cannot be read as {path.suffix[1:].upper()}: {error}'
        ) from error
    if faces.ndim != 2 or faces.shape[1:] != (3,) or vertices.ndim != 2:
        raise InputError(f'mesh_file {path} has no triangles')
    return vertices.astype(float), faces.astype(np.intp)


def _centre(cut: Cut) -> Array:
    """O, the centre of the free surface, in its plane; of a full tank, of its highest part [m]."""
    area, x, y = cut.surface[:3]
    if area:
        return np.array([x / area, y / area, 0.0])
    top = cut.points[cut.points[:, 2] > -ROUNDING * float(np.ptp(cut.points[:, 2]))]
    x, y = (top[:, :2].min(axis=0) + top[:, :2].max(axis=0)) / 2.0
    return np.array([x, y, 0.0])


def _edge_parts(triangles: Indices, corners: int) -> dict[tuple[int, int], list[int]]:
    """Points that a triangulation has put on the edges of its outlines, in order."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2).tolist()
    inner = {(b, a) for a, b in sides}
    follows = {a: b for a, b in sides if (a, b) not in inner}
    parts = {}
    for corner in range(corners):
        way = [follows[corner]]
        while way[-1] >= corners:
            way.append(follows[way[-1]])
        parts[corner, way[-1]] = way[:-1]
    return parts


def _feet(point: Array, triangles: Array) -> Array:
    """
    Points of triangles that are nearest to a given one, shape (n, 3).

    The foot on the plane if it is in the triangle, else on the nearest side.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    square = np.maximum(np.sum(normal**2, axis=1), np.finfo(float).tiny)
    height = np.sum((point - triangles[:, 0]) * normal, axis=1) / square
    foot = point - height[:, np.newaxis] * normal
    best, distance = foot, np.full(len(triangles), np.inf)
    within = np.ones(len(triangles), dtype=bool)
    for k in range(3):
        begin, way = triangles[:, k], triangles[:, (k + 1) % 3] - triangles[:, k]
        within &= np.sum(np.cross(way, foot - begin) * normal, axis=1) >= 0.0
        length = np.maximum(np.sum(way**2, axis=1), np.finfo(float).tiny)
        along = np.clip(np.sum((point - begin) * way, axis=1) / length, 0.0, 1.0)
        on_side = begin + along[:, np.newaxis] * way
        away = np.sum((point - on_side) ** 2, axis=1)
        best = np.where((away < distance)[:, np.newaxis], on_side, best)
        distance = np.minimum(away, distance)
    return np.asarray(np.where(within[:, np.newaxis], foot, best))
