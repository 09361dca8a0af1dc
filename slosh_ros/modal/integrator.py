"""
Exact propagation of damped modal oscillators under piecewise-linear input.

One mode obeys (THEORY 2.1)

    beta'' + 2 zeta omega beta' + omega^2 beta = -(force + d(carried)/dt)

where `force` is what the specific force does to it and `carried` what the angular rate (or the
velocity, where that is measured) carries along. With p = beta' + 2 zeta omega beta + carried no
input is ever differentiated:

    beta' = p - 2 zeta omega beta - carried,      p' = -omega^2 beta - force.

The eigenvalue s of that pair, s^2 + 2 zeta omega s + omega^2 = 0, makes it one complex equation,

    amplitude = p + s beta,      amplitude' = s amplitude - (force + s carried),

whose solution over an interval with linear input needs only exp(s dt) and two phi-functions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Intervals of a recording jitter, so that their exp and phi-functions must be cheap: up to this
# |s dt| they are one matrix product with the powers of dt, beyond it they are found directly.
_SERIES_RADIUS = 2.0
_SERIES_ORDER = 26  # 2^26 / 26! is far below rounding
_ORDERS = np.arange(float(_SERIES_ORDER))
_STANDARD = 1.0
_SMALL = 0.25  # below it phi_2 by its series; above it the recurrence loses < 2 digits
_SMALL_ORDER = 12  # 0.25^12 / 12! is below rounding
_PHI_2_SERIES = [1.0 / math.factorial(k + 2) for k in range(_SMALL_ORDER)]


class ModalIntegrator:
    """
    The state of a set of modes, moved exactly from sample to sample.

    Parameters
    ----------
    omega : array, shape (n,)
        Natural frequencies [rad/s].
    damping_ratio : array, shape (n,)
        Damping ratios, 0 <= zeta < 1.
    """

    def __init__(self, omega: Array, damping_ratio: Array) -> None:
        n = len(omega)
        self._pole_at_rest: ComplexArray = omega * (
            -damping_ratio + 1j * np.sqrt(1.0 - damping_ratio**2)
        )
        self._fastest = self._fastest_at_rest = float(omega.max(initial=0.0))
        # what beta adds to the amplitude, -conj(s) beta, per its imaginary part
        self._turn = np.asarray(1j - self._pole_at_rest.real / self._pole_at_rest.imag)
        self._series = _series(self._pole_at_rest)
        self._root: float | Array = _STANDARD  # of the gravity over the standard one
        self._pole, self._damped = self._pole_at_rest, self._pole_at_rest.imag
        self._interval = 0.0  # of the gains
        self._amplitude: ComplexArray = np.zeros(n, dtype=complex)
        self._force: Array = np.zeros(n)
        self._carried: Array = np.zeros(n)
        self._drive: ComplexArray | None = None
        self._gains: tuple[ComplexArray, ...] = ()

    @property
    def beta(self) -> Array:
        """Modal coordinates [m], shape (n,)."""
        return self._amplitude.imag / self._damped

    @property
    def beta_rate(self) -> Array:
        """Modal velocities beta' [m/s], shape (n,)."""
        # p - 2 zeta omega beta - carried, with p = Re(amplitude) + zeta omega beta
        return self._amplitude.real + self._pole.real * self.beta - self._carried

    @property
    def wave(self) -> ComplexArray:
        """
        The state without what the tank carries along, shape (n,) [m/s].

        `beta' + zeta omega beta + i omega_d beta`: of constant modulus, but for the damping, while
        nothing acts.
        """
        return self._amplitude - self._carried

    @property
    def root(self) -> float | Array:
        """Root of the gravity over the standard one, of all modes or one a mode."""
        return self._root

    @property
    def longest(self) -> float:
        """Longest interval that `advance_through` takes, under the standard gravity [s]."""
        return _SERIES_RADIUS / self._fastest if self._fastest else math.inf

    @property
    def damped(self) -> Array:
        """Frequencies of the damped modes omega_d [rad/s], shape (n,)."""
        return self._damped

    def drive_of(self, force: ComplexArray | Array, carried: ComplexArray | Array) -> ComplexArray:
        """Return what drives the amplitude, `force + s carried`, per whatever the columns are."""
        pole = self._pole.reshape(-1, *(1,) * (force.ndim - 1))
        return np.asarray(force + pole * carried)

    def under(self, gravity: float | Array) -> None:
        """
        Let another gravity act from here on: all frequencies change with its root.

        Parameters
        ----------
        gravity : float or array, shape (n,)
            Effective gravity over the standard one, positive. Surface and velocity stay.
        """
        root = np.sqrt(gravity) if isinstance(gravity, np.ndarray) else math.sqrt(gravity)
        if isinstance(root, float) and root == self._root:
            return
        stretch = root / self._root - 1.0
        self._amplitude = self._amplitude + (stretch * self._amplitude.imag) * self._turn
        self._root = root
        self._fastest = self._fastest_at_rest * float(np.max(root, initial=0.0))
        self._pole = root * self._pole_at_rest
        self._damped = self._pole.imag
        self._interval = 0.0
        self._drive = None

    def put(self, beta: Array, beta_rate: Array, force: Array, carried: Array) -> None:
        """Put the liquid into a given motion [m], [m/s] under the given input."""
        self._amplitude = np.asarray((beta_rate + carried) - np.conj(self._pole) * beta)
        self._take(force, carried)

    def start(self, force: Array, carried: Array) -> None:
        """Put the liquid to rest relative to the tank, under the given input."""
        self._amplitude = carried.astype(complex)
        self._take(force, carried)

    def advance(
        self, interval: float, force: Array, carried: Array, drive: ComplexArray | None = None
    ) -> None:
        """
        Advance over an interval along which the input runs linearly from the last one to this.

        Parameters
        ----------
        interval : float
            Length of the interval [s], positive.
        force : array, shape (n,)
            Modal forcing per modal mass at the end of the interval [m/s^2].
        carried : array, shape (n,)
            Modal velocity carried by the tank's own motion at the end of the interval [m/s].
        drive : array, shape (n,), optional
            Of `drive_of` for both, if it is at hand.
        """
        if interval != self._interval:  # samples of a simulator come at equal intervals
            self._gains = self._gains_over(interval)
            self._interval = interval
        free, first, last = self._gains
        before = self._drive
        if before is None:
            before = self.drive_of(self._force, self._carried)
        if drive is None:
            drive = self.drive_of(force, carried)
        self._take(force, carried, drive)
        driven = first * before
        driven += last * drive
        amplitude = free * self._amplitude
        amplitude -= driven
        self._amplitude = amplitude

    def advance_through(
        self, intervals: Sequence[float], force: Array, carried: Array, drive: ComplexArray
    ) -> ComplexArray:
        """
        Advance over many intervals, bit for bit as one `advance` each would.

        Parameters
        ----------
        intervals : sequence of k floats
            Their lengths [s], positive, up to `longest`.
        force, carried, drive : array, shape (k, n)
            As for `advance`, at the end of each interval.

        Returns
        -------
        array, shape (k, n)
            The wave at the end of each interval.
        """
        # samples of a simulator come at equal intervals
        distinct, which = np.unique(intervals, return_inverse=True)
        powers = distinct[:, np.newaxis] ** _ORDERS
        gains = each(self._series, powers).view(complex).reshape(len(distinct), 3, -1)[which]
        amplitudes = np.empty_like(drive)
        amplitude, before = self._amplitude, self._drive
        if before is None:
            before = self.drive_of(self._force, self._carried)
        driven = gains[:, 1] * np.vstack([before[np.newaxis], drive[:-1]])
        driven += gains[:, 2] * drive
        for free, forced, slot in zip(gains[:, 0], driven, amplitudes, strict=True):
            np.multiply(free, amplitude, out=slot)
            slot -= forced
            amplitude = slot
        self._interval, self._gains = intervals[-1], tuple(gains[-1].copy())
        self._amplitude = amplitude.copy()
        self._take(force[-1].copy(), carried[-1].copy(), drive[-1].copy())
        return amplitudes - carried

    def coast(self, interval: float, force: Array, carried: Array) -> None:
        """Let the liquid move freely over an interval without input, then take up this one."""
        self._amplitude = self.wave * np.exp(self._pole * interval) + carried
        self._take(force, carried)

    def _take(self, force: Array, carried: Array, drive: ComplexArray | None = None) -> None:
        self._force, self._carried, self._drive = force, carried, drive

    def _gains_over(self, interval: float) -> tuple[ComplexArray, ...]:
        """Gains of the amplitude, of the drive before and of the drive now, (n,) each."""
        if self._fastest * interval > _SERIES_RADIUS:
            x = self._pole * interval
            phi_1, phi_2 = _phi_functions(x)
            return 1.0 + x * phi_1, interval * (phi_1 - phi_2), interval * phi_2
        time = interval * self._root  # gravity only changes the pace
        if isinstance(time, float):
            sums = np.matmul(self._series, time**_ORDERS).view(complex)
            free, first, last = sums.reshape(3, -1)
        else:
            modes = self._series.reshape(3, len(time), 2, _SERIES_ORDER)
            powers = time[:, np.newaxis] ** _ORDERS
            free, first, last = np.einsum('gnck,nk->gnc', modes, powers).view(complex)[..., 0]
        if self._root is _STANDARD:
            return free, first, last
        return free, first / self._root, last / self._root


def _series(pole: ComplexArray) -> Array:
    """
    Coefficients of e^x, t (phi_1 - phi_2) and t phi_2 at x = s t per power of t, (3 n 2, order).

    Real and imaginary part are rows of their own: the sums are real.
    """
    k = np.arange(_SERIES_ORDER - 1)
    factorial = np.array([float(math.factorial(i)) for i in range(_SERIES_ORDER + 1)])
    rows = np.zeros((3, len(pole), _SERIES_ORDER), dtype=complex)
    powers = pole[:, np.newaxis] ** np.arange(_SERIES_ORDER)
    rows[0] = powers / factorial[:-1]
    rows[1, :, 1:] = powers[:, :-1] * (k + 1) / factorial[2:]
    rows[2, :, 1:] = powers[:, :-1] / factorial[2:]
    parts = np.stack([rows.real, rows.imag], axis=2)
    return np.ascontiguousarray(parts.reshape(-1, _SERIES_ORDER))


def _phi_functions(x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """phi_1 = (e^x - 1)/x and phi_2 = (e^x - 1 - x)/x^2."""
    small = np.abs(x) < _SMALL
    safe = np.where(small, 1.0, x)
    direct = np.expm1(safe) / safe
    phi_2 = np.where(small, _phi_2_series(np.where(small, x, 0.0)), (direct - 1.0) / safe)
    return np.where(small, 1.0 + x * phi_2, direct), phi_2


def _phi_2_series(x: ComplexArray) -> ComplexArray:
    series: ComplexArray = np.full_like(x, _PHI_2_SERIES[-1])
    for coefficient in reversed(_PHI_2_SERIES[:-1]):
        series = series * x + coefficient
    return series


def each(matrix: Array, vectors: Array) -> Array:
    """Multiply each row by a matrix, one by one: one product of them all would round otherwise."""
    return np.asarray(np.matmul(matrix, vectors[:, :, np.newaxis])[:, :, 0])
