"""Dividing triangles, and the loops along their edge, until no side is too long."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank.surface import Array

Indices = NDArray[np.intp]

_MANY = 20_000  # triangles, that is long needles if they are still not small enough


def refined(
    points: Array, triangles: Indices, loops: Sequence[Indices], size: float
) -> tuple[Array, Indices, tuple[Indices, ...]]:
    """
    Halve sides that are longer than a size, in all triangles that share them.

    Parameters
    ----------
    points : array, shape (n, 3)
        Corners [m].
    triangles : array of int, shape (m, 3)
        Their numbers.
    loops : sequence of array of int
        Lines along sides of triangles, closed.
    size : float
        Longest side that is left [m].

    Returns
    -------
    points, triangles, loops
        The same surface; longer sides are left if the triangles become very many.
    """
    while True:
        sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
        unique, number = np.unique(
            np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True
        )
        length = np.linalg.norm(points[unique[:, 1]] - points[unique[:, 0]], axis=1)
        long = length > size
        if not long.any() or len(triangles) > _MANY:
            return points, triangles, tuple(loops)
        middle = np.full(len(unique), -1)
        middle[long] = len(points) + np.arange(np.count_nonzero(long))
        points = np.concatenate([points, points[unique[long]].mean(axis=1)])
        halves = {
            (int(a), int(b)): int(m) for (a, b), m in zip(unique[long], middle[long], strict=True)
        }
        loops = [_halved(loop, halves) for loop in loops]
        triangles = _divided(points, triangles, middle[number.reshape(-1, 3)])


def _halved(loop: Indices, halves: Mapping[tuple[int, int], int]) -> Indices:
    """Put the middles of divided sides into a loop."""
    line = []
    for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
        line.append(a)
        if (middle := halves.get((min(a, b), max(a, b)))) is not None:
            line.append(middle)
    return np.array(line)


def _divided(points: Array, triangles: Indices, middle: Indices) -> Indices:
    """Divide triangles at the middles of their sides, -1 where a side stays whole."""
    split = middle >= 0
    count = split.sum(axis=1)
    # turned so that the side that is alone in being divided, or in being whole, comes first
    alone = np.where((count == 1)[:, np.newaxis], split, ~split)
    turn = (alone.argmax(axis=1)[:, np.newaxis] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, turn, axis=1).T
    # with two divided, the quadrilateral a, b, bc, ca is cut along its shorter diagonal
    short = np.linalg.norm(points[a] - points[bc], axis=1) < np.linalg.norm(
        points[b] - points[ca], axis=1
    )
    one, three = count == 1, count == 3
    two_a, two_b = (count == 2) & short, (count == 2) & ~short
    parts = [
        (count == 0, (a, b, c)),
        (one, (a, ab, c)), (one, (ab, b, c)),
        (two_a, (ca, bc, c)), (two_a, (a, b, bc)), (two_a, (a, bc, ca)),
        (two_b, (ca, bc, c)), (two_b, (a, b, ca)), (two_b, (b, bc, ca)),
        (three, (a, ab, ca)), (three, (ab, b, bc)), (three, (bc, c, ca)), (three, (ab, bc, ca)),
    ]  # fmt: skip
    return np.concatenate([np.stack(corners, axis=1)[which] for which, corners in parts])


def split_edges(
    points: Array, triangles: Indices, parts: Mapping[tuple[int, int], Sequence[Array]]
) -> Array:
    """
    Divide triangles at points on one of their sides.

    Parameters
    ----------
    points : array, shape (n, 3)
        Corners [m].
    triangles : array of int, shape (m, 3)
        Their numbers.
    parts : mapping
        Points in order along a side, by the numbers of its ends; the triangle has it the other
        way round.

    Returns
    -------
    array, shape (k, 3, 3)
        Corners of all triangles [m].
    """
    done: list[Array] = []
    keep = np.ones(len(triangles), dtype=bool)
    for i, (a, b, c) in enumerate(triangles.tolist()):
        sides = [(a, b, c), (b, c, a), (c, a, b)]
        cut = [(p, q, r) for p, q, r in sides if parts.get((q, p))]
        if not cut:
            continue
        keep[i] = False
        # around a point within, so that several sides may be divided
        ring: list[Array] = []
        for p, q, _ in sides:
            ring += [points[p], *list(parts.get((q, p), ()))[::-1]]
        if len(cut) == 1:
            p, q, r = cut[0]
            line = [points[p], *list(parts[q, p])[::-1], points[q]]
            done += [np.stack([u, v, points[r]]) for u, v in itertools.pairwise(line)]
        else:
            apex = np.mean(points[[a, b, c]], axis=0)
            ends = [*ring[1:], ring[0]]
            done += [np.stack([u, v, apex]) for u, v in zip(ring, ends, strict=True)]
    return np.concatenate([points[triangles[keep]], np.array(done).reshape(-1, 3, 3)])
