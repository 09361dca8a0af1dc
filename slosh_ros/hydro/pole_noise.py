"""
How far data lie from a fit, and how much that tells.

Deviations follow Student's t: with few degrees of freedom it lets single points go, as the spikes
of an ill-conditioned matrix at resonance are. Their spread is not known beforehand: the variance
is made up of parts, as a noise that is the same at all frequencies and one in proportion to the
data, with the factors that make the deviations most likely.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FREEDOM = 4.0  # degrees, as Lange, Little & Taylor advise (J. Am. Stat. Assoc. 84, 1989)
ROUNDS = 40  # of finding the factors


def weight(square: Array) -> Array:
    """How much a value counts whose deviation over its spread has this square."""
    return (FREEDOM + 1.0) / (FREEDOM + square)


def surprise(square: Array) -> Array:
    """Minus twice the logarithm of the likelihood of a value, but for its spread."""
    return (FREEDOM + 1.0) * np.log1p(square / FREEDOM)


def steepness(square: Array) -> Array:
    """How fast weight times deviation rises with the deviation."""
    return (FREEDOM + 1.0) * (FREEDOM - square) / (FREEDOM + square) ** 2


def spread(deviation: Array, parts: Sequence[Array], least: Array, each: bool) -> Array:
    """
    Most likely spread of each value.

    Parameters
    ----------
    deviation : array, shape (entries, n)
        Of data from a fit.
    parts : sequence of array, shape (entries, n)
        What the variance is made up of, but for a factor each.
    least : array, shape (entries, n)
        Variance that is there in any case.
    each : bool
        Each entry has its own factors; else all entries share them.

    Returns
    -------
    array, shape (entries, n)
    """
    square, axis = deviation**2, 1 if each else None

    def total(of: Array) -> Array:
        return np.asarray(np.sum(of, axis=axis, keepdims=True))

    shares = [
        part * np.median(square / part, axis=axis, keepdims=True) / len(parts) for part in parts
    ]
    for _ in range(ROUNDS):  # minorise, maximise (Zhou et al., J. Comput. Graph. Stat. 28, 2019)
        variance = least + np.sum(shares, axis=0)
        pull = weight(square / variance) * square / variance**2
        shares = [
            share * np.sqrt(total(pull * part) / total(part / variance))
            for share, part in zip(shares, parts, strict=True)
        ]
    return np.asarray(np.sqrt(least + np.sum(shares, axis=0)))
