"""
Pressure of the liquid at points of it or of its wall: eq (37) for any motion (THEORY 2.2).

    p = p_0 - rho [ s . r + sum_k Omega_k alpha_k + sum_j beta_j''/kappa_j phi_j ],

r from O. What is left of it without p_0 and the hydrostatic pressure -rho g z of the level tank at
rest is linear in the modal coordinates, their rates and the acceleration (s, alpha) of O.

The modes that are not kept follow the acceleration without delay: beta'' = 0. Nothing need be
added for them, unlike in the moments. In a tank at rest every beta'' is zero, and the rest,
-rho (s_x x + s_y y), is the whole pressure under the tilted surface at every depth, however few
modes there are.

Linear theory keeps the wall wet up to the mean free surface: where a trough lays it bare, the
pressure goes on below that of the gas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients

Array = NDArray[np.float64]

_REST = np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, 0.0])  # acceleration of a level tank at rest


@dataclass(frozen=True, eq=False)
class PressureMatrices:
    """
    Matrices of the pressure at p points, less that of the level tank at rest [Pa].

    Damping acts through beta'' alone, as in the force.

    Attributes
    ----------
    stiffness, damping : array, shape (p, n)
        Pressure per modal coordinate and per modal velocity.
    acceleration : array, shape (p, 6)
        Pressure per acceleration (s, alpha) of O in tank axes beyond that of rest.
    """

    stiffness: Array
    damping: Array
    acceleration: Array

    @classmethod
    def of(
        cls, coefficients: ModalCoefficients, damping_ratio: Array, points: Array
    ) -> PressureMatrices:
        """
        Build the matrices for points of the liquid.

        Parameters
        ----------
        coefficients : ModalCoefficients
            Of the liquid.
        damping_ratio : array, shape (n,)
            Of the modes.
        points : array, shape (p, 3)
            About O in tank axes [m].

        Raises
        ------
        InputError
            If the coefficients come without potentials.
        """
        c = coefficients
        if c.potentials is None:
            raise InputError(
                f'the coefficients by the route "{c.route}" tell no pressure; '
                'remove the pressure points of their tank'
            )
        phi = c.potentials.modes(points)
        # beta'' = -omega^2 beta - 2 zeta omega beta' - (lambda . acceleration)/mu
        inertia = c.density * GRAVITY / c.omega**2 * phi  # rho phi/kappa
        motion = np.hstack([points, c.potentials.stokes_joukowski(points)])
        return cls(
            stiffness=inertia * c.omega**2,
            damping=inertia * (2.0 * damping_ratio * c.omega),
            acceleration=(inertia / c.mu) @ c.coupling - c.density * motion,
        )

    def at(self, beta: Array, beta_rate: Array, acceleration: Array) -> Array:
        """
        Pressure at the points less that of the level tank at rest, shape (p,) [Pa].

        Parameters
        ----------
        beta, beta_rate : array, shape (n,)
            Modal coordinates [m] and velocities [m/s].
        acceleration : array, shape (6,)
            Specific force [m/s^2] and angular acceleration [rad/s^2] of O in tank axes.
        """
        state = self.stiffness @ beta + self.damping @ beta_rate
        return np.asarray(state + self.acceleration @ (acceleration - _REST))
