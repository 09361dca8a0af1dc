"""The height of the waves in tanks, and a bound on it that costs next to nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slosh_ros.modal.integrator import each

Array = NDArray[np.float64]


class WaveHeights:
    """
    Largest height or depth of the waves in tanks.

    Parameters
    ----------
    shapes : sequence of arrays, shape (m, n) each
        Mode shapes at points of the free surface, tank by tank [-].
    """

    def __init__(self, shapes: Sequence[Array]) -> None:
        self._shapes = [_distinct(one) for one in shapes]
        ends = np.cumsum([one.shape[1] for one in shapes]).tolist()
        self._parts = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        # what each mode alone can lift, its tank in the column
        self._most = np.zeros((ends[-1], len(shapes)))
        for tank, (part, one) in enumerate(zip(self._parts, shapes, strict=True)):
            self._most[part, tank] = np.abs(one).max(axis=0, initial=0.0)

    def highest(self, beta: Array) -> list[float]:
        """
        Return the largest height or depth in each tank [m].

        Parameters
        ----------
        beta : array, shape (n,)
            Modal coordinates of all tanks [m].
        """
        highest = []
        for part, shapes in zip(self._parts, self._shapes, strict=True):
            heights = np.abs(np.dot(shapes, beta[part]))
            highest.append(float(heights[heights.argmax()]) if len(heights) else 0.0)
        return highest

    def highest_of_all(self, beta: Array) -> Array:
        """Return the largest of `highest` for each row of beta, shape (k, n); shape (k,) [m]."""
        highest = np.zeros(len(beta))
        for part, shapes in zip(self._parts, self._shapes, strict=True):
            heights = np.abs(each(shapes, beta[:, part]))
            np.maximum(highest, heights.max(axis=1, initial=0.0), out=highest)
        return highest

    def at_most(self, beta: Array) -> Array:
        """
        Return what the wave in each tank cannot be higher than [m]: all crests at one place.

        Of beta of shape (k, n), a row for each.
        """
        return np.asarray(np.dot(np.abs(beta), self._most))


def _distinct(shapes: Array) -> Array:
    """
    Leave out points whose wave is that of another point, or its mirror image.

    In a symmetric tank that is half of them or more; no wave is higher for it.
    """
    if not shapes.size:
        return shapes[:0]
    # alike but for their sign are those of which some odd sum of the modes is
    weights = np.random.default_rng(1).normal(size=shapes.shape[1])
    _, kept = np.unique(np.round(np.abs(shapes @ weights), 12), return_index=True)
    return np.ascontiguousarray(shapes[np.sort(kept)])
