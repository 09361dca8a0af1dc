"""Exact steps of a linear time-invariant system under polynomial inputs."""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Propagator:
    """
    Solve `x' = A x + B v(t)` exactly, `v` a polynomial of the time since the step began.

    Parameters
    ----------
    a : array, shape (n, n)
        System matrix [1/s].
    b : array, shape (n, m)
        Input matrix.
    degree : int
        Degree of the polynomials.
    """

    def __init__(self, a: Array, b: Array, degree: int) -> None:
        self.a = a
        self.b = b
        self.degree = degree
        # a step is repeated thousands of times, cuts at events only once or twice
        self.transition = lru_cache(maxsize=16)(self._transition)

    def step(self, x: Array, inputs: Array, duration: float) -> Array:
        """
        Advance a state.

        Parameters
        ----------
        x : array, shape (n,)
            State at the start.
        inputs : array, shape (degree + 1, m)
            Coefficients of `v` in rising powers of the time since the start.
        duration : float
            Length of the step [s].

        Returns
        -------
        array, shape (n,)
            State at the end.
        """
        free, forced = self.transition(duration)
        return np.asarray(free @ x + forced @ inputs.ravel())

    def _transition(self, duration: float) -> tuple[Array, Array]:
        """
        Find `exp(A h)` (n, n) and the response (n, (degree + 1) m) to each coefficient.

        Van Loan: the inputs join the state as a chain of integrators, `v_k' = v_(k+1)`, started
        at `v_k = k! c_k`.
        """
        n, m = self.b.shape
        links = (self.degree + 1) * m
        chain = np.zeros((n + links, n + links))
        chain[:n, :n] = self.a
        chain[:n, n : n + m] = self.b
        chain[n:, n:] = np.eye(links, k=m)
        exponential = scipy.linalg.expm(chain * duration)
        scale = np.repeat([float(factorial(k)) for k in range(self.degree + 1)], m)
        return exponential[:n, :n], exponential[:n, n:] * scale
