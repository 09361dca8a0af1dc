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

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_SERIES_RADIUS = 0.25  # below it phi_2 by its series; above it the recurrence loses < 2 digits
_SERIES_ORDER = 12  # 0.25^12 / 12! is below rounding
_PHI_2_SERIES = [1.0 / math.factorial(k + 2) for k in range(_SERIES_ORDER)]


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
        self._pole_at_rest: ComplexArray = omega * (
            -damping_ratio + 1j * np.sqrt(1.0 - damping_ratio**2)
        )
        self._gravity = 1.0
        self._pole, self._interval = self._pole_at_rest, 0.0
        self._tune(self._pole_at_rest)
        self._amplitude: ComplexArray = np.zeros(len(omega), dtype=complex)
        self._force: Array = np.zeros(len(omega))
        self._carried: Array = np.zeros(len(omega))
        self._drive: ComplexArray = np.zeros(len(omega), dtype=complex)
        self._gains = (self._drive, self._drive, self._drive)

    @property
    def beta(self) -> Array:
        """Modal coordinates [m], shape (n,)."""
        return self._amplitude.imag / self._damped

    @property
    def beta_rate(self) -> Array:
        """Modal velocities beta' [m/s], shape (n,)."""
        # p - 2 zeta omega beta - carried, with p = Re(amplitude) + zeta omega beta
        return self._amplitude.real - self._decay * self.beta - self._carried

    @property
    def envelope(self) -> Array:
        """Amplitudes that the modes would keep without damping and input [m], shape (n,)."""
        return np.asarray(np.abs(self._amplitude - self._carried) / self._damped)

    def under(self, gravity: float) -> None:
        """
        Let another gravity act from here on: all frequencies change with its root.

        Parameters
        ----------
        gravity : float
            Effective gravity over the standard one, positive. Surface and velocity stay.
        """
        if gravity == self._gravity:
            return
        beta, beta_rate = self.beta, self.beta_rate
        self._gravity = gravity
        self._tune(self._pole_at_rest * math.sqrt(gravity))
        turn = np.conj(-self._pole)  # zeta omega + i omega_d
        self._amplitude = (turn * beta + (beta_rate + self._carried)).astype(complex)
        self._take(self._force, self._carried)

    def start(self, force: Array, carried: Array) -> None:
        """Put the liquid to rest relative to the tank, under the given input."""
        self._amplitude = carried.astype(complex)
        self._take(force, carried)

    def advance(self, interval: float, force: Array, carried: Array) -> None:
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
        """
        if interval != self._interval:  # samples of a simulator come at equal intervals
            x = self._pole * interval
            phi_1, phi_2 = _phi_functions(x)
            self._gains = 1.0 + x * phi_1, interval * (phi_1 - phi_2), interval * phi_2
            self._interval = interval
        before = self._drive
        self._take(force, carried)
        free, first, last = self._gains
        self._amplitude = free * self._amplitude + first * before + last * self._drive

    def coast(self, interval: float, force: Array, carried: Array) -> None:
        """Let the liquid move freely over an interval without input, then take up this one."""
        free = (self._amplitude - self._carried) * np.exp(self._pole * interval)
        self._amplitude = free + carried
        self._take(force, carried)

    def _tune(self, pole: ComplexArray) -> None:
        self._pole, self._decay, self._damped = pole, -pole.real, pole.imag
        self._interval = 0.0  # of the gains, which are to be found anew

    def _take(self, force: Array, carried: Array) -> None:
        self._force, self._carried = force, carried
        self._drive = -(force + self._pole * carried)


def _phi_functions(x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """phi_1 = (e^x - 1)/x and phi_2 = (e^x - 1 - x)/x^2."""
    size = np.abs(x)
    if size.max(initial=0.0) < _SERIES_RADIUS:
        phi_2 = _phi_2_series(x)
        return 1.0 + x * phi_2, phi_2
    small = size < _SERIES_RADIUS
    safe = np.where(small, 1.0, x)
    direct = np.expm1(safe) / safe
    phi_2 = np.where(small, _phi_2_series(np.where(small, x, 0.0)), (direct - 1.0) / safe)
    return np.where(small, 1.0 + x * phi_2, direct), phi_2


def _phi_2_series(x: ComplexArray) -> ComplexArray:
    series: ComplexArray = np.full_like(x, _PHI_2_SERIES[-1])
    for coefficient in reversed(_PHI_2_SERIES[:-1]):
        series = series * x + coefficient
    return series
