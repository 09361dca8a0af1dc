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
pressure goes on below that of the gas. Above the mean free surface there is gas, whose pressure is
the zero of the scale, also where a crest would wet the wall.
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
        Build the matrices for points of the tank.

        Parameters
        ----------
        coefficients : ModalCoefficients
            Of the liquid.
        damping_ratio : array, shape (n,)
            Of the modes.
        points : array, shape (p, 3)
            About O in tank axes [m]. Those above O are dry: nothing changes their pressure.

        Raises
        ------
        InputError
            If the coefficients come without potentials.
        """
        c, wet = coefficients, points[:, 2] <= 0.0
        matrices = cls(*(np.zeros((len(points), n)) for n in (len(c.omega), len(c.omega), 6)))
        if not wet.any():
            return matrices
        if c.potentials is None:
            raise InputError(
                f'the coefficients by the route "{c.route}" tell no pressure; '
                'remove the pressure points of their tank'
            )
        phi = c.potentials.modes(points[wet])
        # beta'' = -omega^2 beta - 2 zeta omega beta' - (lambda . acceleration)/mu
        inertia = c.density * GRAVITY / c.omega**2 * phi  # rho phi/kappa
        motion = np.hstack([points[wet], c.potentials.stokes_joukowski(points[wet])])
        matrices.stiffness[wet] = inertia * c.omega**2
        matrices.damping[wet] = inertia * (2.0 * damping_ratio * c.omega)
        matrices.acceleration[wet] = (inertia / c.mu) @ c.coupling - c.density * motion
        return matrices

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
