"""A manoeuvre over a road: what every wheel sees, and when the inputs have a kink."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import Bump
from slosh_ros.vehicle.truck import Truck

Array = NDArray[np.float64]

DEGREE = 6
"""Degree in time of the inputs between events: a parabola of a cubic distance."""

TIME_TOLERANCE = 1e-12
"""Instants closer than this are one [s]."""


@dataclass(frozen=True)
class Contact:
    """
    Passage of one axle over the bump.

    Attributes
    ----------
    axle : int
        Number of the axle, from 1 at the front.
    entry, exit : float
        Times at the near and the far edge [s]; infinite if the truck stops before.
    """

    axle: int
    entry: float
    exit: float


class Journey:
    """
    The truck's prescribed way along the road.

    Parameters
    ----------
    truck : Truck
        Whose axles pass over the road.
    manoeuvre : Manoeuvre
        How it drives.
    road : Bump
        Where it drives.

    Attributes
    ----------
    contacts : tuple of Contact
        One for each axle, front to rear.
    events : array, shape (n,)
        Rising times at which an axle meets or leaves the bump or the acceleration has a kink [s];
        between two events the inputs are polynomials in time.
    """

    def __init__(self, truck: Truck, manoeuvre: Manoeuvre, road: Bump) -> None:
        self.truck = truck
        self.manoeuvre = manoeuvre
        self.road = road
        self._offsets = truck.parameters.wheel_offsets
        self.contacts = tuple(
            Contact(i, manoeuvre.time_at(road.start + x), manoeuvre.time_at(road.end + x))
            for i, x in enumerate(self._offsets.tolist(), start=1)
        )
        edges = [t for c in self.contacts for t in (c.entry, c.exit) if isfinite(t)]
        self.events: Array = np.unique([*edges, *self.manoeuvre.knots[1:]])
        self._entries = np.array([c.entry for c in self.contacts])
        self._exits = np.array([c.exit for c in self.contacts])

    def edges(self, start: float, stop: float) -> list[float]:
        """
        Cut an interval at the events inside it.

        Parameters
        ----------
        start, stop : float
            Ends of the interval [s].

        Returns
        -------
        list of float
            Start, the events between, stop [s].
        """
        t = self.events
        inner = t[(t > start + TIME_TOLERANCE) & (t < stop - TIME_TOLERANCE)]
        return [start, *inner.tolist(), stop]

    def inputs(self, times: Array, inside: float) -> Array:
        """
        Expand the inputs of the truck about given times, all between the same two events.

        Parameters
        ----------
        times : array, shape (n,)
            Times [s].
        inside : float
            A time between the two events; it decides which axles are on the bump [s].

        Returns
        -------
        array, shape (n, DEGREE + 1, 5)
            Coefficients in rising powers of time of the road's force `k_w z_w + c_w z_w'` at the
            four axles [N] and of the acceleration [m/s^2].
        """
        distance = self.manoeuvre.taylor(times, inside)
        inputs = np.zeros((len(times), DEGREE + 1, 5))
        inputs[:, 0, 4] = 2.0 * distance[:, 2]
        inputs[:, 1, 4] = 6.0 * distance[:, 3]
        on_bump = np.flatnonzero((self._entries <= inside) & (inside < self._exits))
        if on_bump.size:
            p = self.truck.parameters
            height = self._elevation(distance, self._offsets[on_bump])
            rate = np.arange(1, DEGREE + 1)[:, np.newaxis] * height[:, 1:]
            force = p.axle_stiffness * height
            force[:, :-1] += p.axle_damping * rate
            inputs[:, :, on_bump] = force
        return inputs

    def _elevation(self, distance: Array, offsets: Array) -> Array:
        """Road height under axles on the bump (n, DEGREE + 1, axles), in powers of time [m]."""
        slope, half_curvature = self.road.coefficients
        along = np.repeat(distance[:, :, np.newaxis], len(offsets), axis=2)
        along[:, 0] -= self.road.start + offsets
        height = np.zeros((len(distance), DEGREE + 1, len(offsets)))
        height[:, :4] = slope * along
        for power in range(4):
            height[:, power : power + 4] += half_curvature * along[:, power, np.newaxis] * along
        return height
