"""
The liquid as a simulator of the vehicle has to know it (VEHICLE 8): constant matrices.

A simulator that carries the liquid as a frozen mass feels, on top of it, the sloshing wrench. What
of that wrench follows the acceleration at once is a matrix here, so that it can be solved for
together with the acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.modal.loads import cross_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CarriedLiquid:
    """
    6 x 6 matrices of the liquid, about O in tank axes unless moved; those of several tanks add.

    Wrenches are force and moment stacked, accelerations (s, alpha) likewise.

    Attributes
    ----------
    coupling : array, shape (6, 6)
        Sloshing wrench per acceleration: sum of lambda lambda^T / mu.
    relief : array, shape (6, 6)
        `I_f - J0` (THEORY 2.2), the moment by which a frozen liquid is harder to turn than the
        real one, per angular acceleration.
    inertia : array, shape (6, 6)
        Of the frozen liquid: its negative is its wrench per acceleration.
    """

    coupling: Array
    relief: Array
    inertia: Array

    @classmethod
    def of(cls, coefficients: ModalCoefficients) -> CarriedLiquid:
        """Build the matrices of the liquid in one tank."""
        c = coefficients
        lambdas = c.coupling.T
        arm = c.mass * cross_matrix(c.liquid.centroid)
        relief = np.zeros((6, 6))
        relief[3:, 3:] = c.inertia_frozen - c.inertia_stokes_joukowski
        return cls(
            coupling=(lambdas / c.mu) @ lambdas.T,
            relief=relief,
            inertia=np.block([[c.mass * np.eye(3), -arm], [arm, c.inertia_frozen]]),
        )

    def moved(self, transform: Array) -> CarriedLiquid:
        """Refer wrenches and accelerations to another frame; see `wrench_transform`."""
        return CarriedLiquid(*(transform @ m @ transform.T for m in self._matrices))

    def __add__(self, other: CarriedLiquid) -> CarriedLiquid:
        pairs = zip(self._matrices, other._matrices, strict=True)
        return CarriedLiquid(*(one + two for one, two in pairs))

    @property
    def coupling_exact(self) -> Array:
        """`coupling` for a liquid that turns with its Stokes-Joukowski inertia, (6, 6)."""
        return self.coupling + self.relief

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return float(self.inertia[0, 0])

    @property
    def centroid(self) -> Array:
        """Centroid (3,) [m]; the origin, if there is no liquid."""
        if not self.mass:
            return np.zeros(3)
        arm = self.inertia[3:, :3]  # mass times [c x]
        return np.array([arm[2, 1], arm[0, 2], arm[1, 0]]) / self.mass

    @property
    def inertia_at_centroid(self) -> Array:
        """Inertia of the frozen liquid about its centroid, (3, 3) [kg m^2]."""
        across = cross_matrix(self.centroid)
        return np.asarray(self.inertia[3:, 3:] + self.mass * across @ across)

    @property
    def _matrices(self) -> tuple[Array, Array, Array]:
        return self.coupling, self.relief, self.inertia
