"""
What of a closed surface of triangles lies below a level, cut there exactly.

A corner within rounding of the level counts as above it, so that each triangle is whole, absent or
cut through two of its edges, and each edge that is cut joins two triangles: the contact line is
made up of closed loops.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.tank.polygon import outline_moments
from slosh_ros.tank.surface import Array
from slosh_ros.tank.triangulation import inside

Indices = NDArray[np.intp]

ROUNDING = 1e-9  # [heights of the surface]


@dataclass(frozen=True, eq=False)
class Cut:
    """
    The part of a closed surface below z = 0.

    Attributes
    ----------
    points : array, shape (n, 3)
        Corners, those of the contact line with z = 0 exactly.
    wall : array of int, shape (m, 3)
        Corners of the triangles below, normals out of the liquid.
    loops : tuple of array of int
        Corners of the pieces of the contact line, counter-clockwise from above around liquid and
        clockwise around what is dry.
    bodies : array of int, shape (m,)
        Which connected part of the wall each triangle belongs to.
    """

    points: Array
    wall: Indices
    loops: tuple[Indices, ...]
    bodies: Indices

    @cached_property
    def outlines(self) -> list[Array]:
        """The loops as corners x, y, each of shape (k, 2) [m]."""
        return [self.points[loop, :2] for loop in self.loops]

    @cached_property
    def pieces(self) -> list[tuple[int, list[int]]]:
        """Pieces of the free surface: their outer loop, and the loops of their holes."""
        areas = [outline_moments(outline)[0] for outline in self.outlines]
        outer = sorted((i for i, area in enumerate(areas) if area > 0.0), key=lambda i: areas[i])
        holes: dict[int, list[int]] = {i: [] for i in outer}
        for i, area in enumerate(areas):
            if area < 0.0:
                # the smallest that it lies in
                middle = self.outlines[i][:1]
                around = [o for o in outer if inside([self.outlines[o]], middle)[0]]
                if around:
                    holes[around[0]].append(i)
        return list(holes.items())

    @property
    def surface(self) -> Array:
        """Integrals of 1, x, y, x^2, x y and y^2 over the free surface, shape (6,)."""
        return sum((outline_moments(outline) for outline in self.outlines), start=np.zeros(6))

    @property
    def pools(self) -> int:
        """Number of bodies of liquid with a free surface that are not connected."""
        touched = np.full(len(self.points), -1)
        touched[self.wall] = self.bodies[:, np.newaxis]
        links = [
            (int(self.bodies.max(initial=-1)) + 1 + k, int(touched[self.loops[i]].max()))
            for k, (outer, holes) in enumerate(self.pieces)
            for i in (outer, *holes)
        ]
        if not links:
            return 0
        nodes = np.array(links)
        size = int(nodes.max()) + 1
        graph = scipy.sparse.coo_matrix((np.ones(len(nodes)), nodes.T), shape=(size, size))
        return len(
            np.unique(
                scipy.sparse.csgraph.connected_components(graph, directed=False)[1][nodes[:, 0]]
            )
        )


def cut_below(vertices: Array, faces: Indices, level: float) -> Cut:
    """
    Cut a closed surface.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        Corners [m].
    faces : array of int, shape (m, 3)
        Of its triangles, normals outwards.
    level : float
        Height at which it is cut; z counts from there [m].
    """
    points = vertices - [0.0, 0.0, level]
    z = points[:, 2]
    rounding = ROUNDING * float(np.ptp(z))
    is_below = z < -rounding
    if level >= vertices[:, 2].max() - rounding:
        is_below[:] = True
    count = is_below[faces].sum(axis=1)
    whole, partly = np.flatnonzero(count == 3), np.flatnonzero((count == 1) | (count == 2))
    if not len(partly):
        return Cut(points, faces[whole], (), _bodies(faces, is_below, whole))
    # turned so that the corner that is alone on its side comes first
    cut = faces[partly]
    alone = is_below[cut] == (is_below[cut].sum(axis=1) == 1)[:, np.newaxis]
    turn = (alone.argmax(axis=1)[:, np.newaxis] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(cut, turn, axis=1).T

    edges = np.sort(np.stack([np.stack([a, b], 1), np.stack([c, a], 1)]), axis=2)
    unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    first, last = number.reshape(2, -1)
    crossing, joined = _crossings(points, unique, is_below, rounding)
    points = np.concatenate([points, crossing])
    node = len(vertices) + joined
    ab, ca = node[first], node[last]

    one = is_below[a]
    wall = np.concatenate(
        [
            faces[whole],
            np.stack([a, ab, ca], axis=1)[one],
            np.stack([ab, b, c], axis=1)[~one],
            np.stack([ab, c, ca], axis=1)[~one],
        ]
    )
    source = np.concatenate([whole, partly[one], partly[~one], partly[~one]])
    bodies = _bodies(faces, is_below, source)
    proper = (wall[:, 0] != wall[:, 1]) & (wall[:, 1] != wall[:, 2]) & (wall[:, 2] != wall[:, 0])
    # the free surface passes along a cut against the direction of the wall
    begin, end = np.where(one, last, first).tolist(), np.where(one, first, last).tolist()
    follows = dict(zip(begin, end, strict=True))
    return Cut(points, wall[proper], _loops(follows, node, points), bodies[proper])


def _crossings(
    points: Array, edges: Indices, is_below: NDArray[np.bool_], rounding: float
) -> tuple[Array, Indices]:
    """Points at which edges meet z = 0, and which of them to take: one for each corner."""
    low = np.where(is_below[edges[:, 0]], edges[:, 0], edges[:, 1])
    high = edges.sum(axis=1) - low
    below, above = points[low], points[high]
    at_corner = above[:, 2] <= rounding
    share = below[:, 2] / (below[:, 2] - np.where(at_corner, 0.0, above[:, 2]))
    found = below + share[:, np.newaxis] * (above - below)
    found[at_corner] = above[at_corner]
    found[:, 2] = 0.0
    # edges that end in one corner of the level are cut in one point
    joined = np.arange(len(edges))
    corner = np.flatnonzero(at_corner)
    _, begin, back = np.unique(high[corner], return_index=True, return_inverse=True)
    joined[corner] = corner[begin][back]
    return found, joined


def _bodies(faces: Indices, is_below: NDArray[np.bool_], source: Indices) -> Indices:
    """Which connected part of the wall the given triangles belong to: joined through corners."""
    wet = is_below[faces]
    begin, end = faces[:, [0, 1, 2]], faces[:, [1, 2, 0]]
    both = wet & wet[:, [1, 2, 0]]
    size = len(is_below)
    graph = scipy.sparse.coo_matrix(
        (np.ones(np.count_nonzero(both)), (begin[both], end[both])), shape=(size, size)
    )
    part = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    corner = np.take_along_axis(faces, wet.argmax(axis=1)[:, np.newaxis], axis=1)[:, 0]
    return np.unique(part[corner[source]], return_inverse=True)[1].reshape(-1)


def _loops(follows: dict[int, int], node: Indices, points: Array) -> tuple[Indices, ...]:
    """Chain cut edges to loops of points; what shrinks to a point or a line is none."""
    loops = []
    while follows:
        edge = start = min(follows)
        loop: list[int] = []
        while True:
            if not loop or loop[-1] != node[edge]:
                loop.append(int(node[edge]))
            edge = follows.pop(edge)
            if edge == start:
                break
        if len(loop) > 1 and loop[0] == loop[-1]:
            loop.pop()
        if len(loop) > 2 and outline_moments(points[loop, :2])[0] != 0.0:
            loops.append(np.array(loop))
    return tuple(loops)
