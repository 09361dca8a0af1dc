"""The sloshing modes of the tank as the vehicle needs them: plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LiquidModes:
    """
    Modal coefficients about O, the centre of the mean free surface; n modes, x forward, z up.

    Attributes
    ----------
    omega : array, shape (n,)
        Natural frequencies [rad/s].
    mu : array, shape (n,)
        Modal masses, eq (10) [kg].
    coupling : array, shape (n, 6)
        Coupling coefficients, eqs (11)-(14): columns 1-3 [kg] (the third is zero), 4-6 [kg m].
    damping_ratio : array, shape (n,)
        Damping ratios; zero in the paper.
    """

    omega: Array
    mu: Array
    coupling: Array
    damping_ratio: Array

    def __post_init__(self) -> None:
        """Refuse arrays whose shapes disagree."""
        n = len(self.omega)
        shapes = (self.mu.shape, self.damping_ratio.shape, self.coupling.shape)
        if shapes != ((n,), (n,), (n, 6)):
            raise InputError(
                f'{n} modes need mu and damping_ratio of shape ({n},) and coupling of shape '
                f'({n}, 6), got {shapes[0]}, {shapes[1]} and {shapes[2]}'
            )

    @classmethod
    def none(cls) -> LiquidModes:
        """Give no modes at all: a solid cargo."""
        return cls(np.empty(0), np.empty(0), np.empty((0, 6)), np.empty(0))

    def coupling_at(self, origin: Array) -> Array:
        """
        Move the coupling coefficients from O to `base_link`.

        Parameters
        ----------
        origin : array, shape (3,)
            Position of O in `base_link` [m].

        Returns
        -------
        array, shape (n, 6)
            `coupling` with the moment of the translational part added, for instance
            `lambda_5 + z_O lambda_1`.
        """
        moved = self.coupling.copy()
        moved[:, 3:] += np.cross(origin, self.coupling[:, :3])
        return moved

    @property
    def tilt(self) -> Array:
        """
        Weight of the displaced liquid (n, 6): wrench per unit of beta, eqs (18)-(19) [N, N m/m].

        A pure moment, hence the same at every point.
        """
        wrench = np.zeros_like(self.coupling)
        wrench[:, 3] = -GRAVITY * self.coupling[:, 1]
        wrench[:, 4] = GRAVITY * self.coupling[:, 0]
        return wrench

    @property
    def softening(self) -> Array:
        """
        Stiffness (6, 6) the free surface takes from the vehicle: the liquid runs to the low end.

        Static moment per small rotation, `sum tilt tilt^T / (mu omega^2)`; about the y axis
        `sum g^2 lambda_1^2 / (mu omega^2)` [N m/rad].
        """
        tilt = self.tilt
        return np.asarray((tilt.T / (self.mu * self.omega**2)) @ tilt)


TABLE_4 = LiquidModes(
    omega=np.array([0.675]),
    mu=np.array([300440.0]),
    coupling=np.array([[-85382.9, 0.0, 0.0, 0.0, 82010.0, 0.0]]),
    damping_ratio=np.zeros(1),
)
"""First longitudinal mode of the paper's tank, Table 4.

R = 1.125 m, L = 14 m, half full of water. `lambda_5` is about O, the tank's axis: its ratio to
`lambda_1` is the -2 x 0.477 m of slender-tank theory.
"""

CALIBRATED_DAMPING_RATIO = 0.0214
"""Damping ratio that goes with `TruckParameters.calibrated`: a calibration, not evidence."""
