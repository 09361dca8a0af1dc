"""Added mass of a tank over frequency, as a boundary element code gives it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class AddedMass:
    """
    Total added mass of the liquid in a tank, eq (31), in SI units.

    Axes: x forward, y left, z up. With exp(-i omega t) it is A + i B/omega of the added mass A and
    the radiation damping B; see :mod:`slosh_ros.hydro.frequency`.

    Attributes
    ----------
    omega : array, shape (n,)
        Frequencies [rad/s], rising; 0 and infinity may be among them.
    matrix : array of complex, shape (n, 6, 6)
        Added mass [kg, kg m, kg m^2]; not a number where there is none.
    density : float
        Density of the liquid [kg/m^3].
    reference : array, shape (3,)
        The point of the moments and rotations, from O, the centre of the mean free surface [m].
    hydrostatic : bool
        It comes from the radiation potential alone. False: the code has taken the term
        -rho g (I_yy, I_xx)/omega^2 of the entries 44 and 55 over to its stiffness matrix.
    source : str
        Where it comes from.
    """

    omega: Array
    matrix: ComplexArray
    density: float
    reference: Array
    hydrostatic: bool = True
    source: str = 'added mass'

    def __post_init__(self) -> None:
        """Check that arrays fit together and frequencies rise."""
        if self.matrix.shape != (len(self.omega), 6, 6):
            raise InputError(
                f'{self.source}: {len(self.omega)} frequencies need a matrix of shape '
                f'({len(self.omega)}, 6, 6), not {self.matrix.shape}'
            )
        negative = self.omega[~(self.omega >= 0.0)]
        if negative.size:
            raise InputError(
                f'{self.source}: there is a frequency of {negative[0]:.6g} rad/s; they must be 0 '
                'or greater'
            )
        repeated = self.omega[1:][~(self.omega[1:] > self.omega[:-1])]
        if repeated.size:
            raise InputError(
                f'{self.source}: the frequency {repeated[0]:.6g} rad/s comes twice or out of '
                'order; write each once, rising'
            )

    def has(self, *entries: tuple[int, int]) -> bool:
        """Tell whether every frequency has these entries, rows and columns from 0."""
        return all(bool(np.all(np.isfinite(self.matrix[:, i, j]))) for i, j in entries)

    def about_surface_centre(self, surface_inertia: Array | None = None) -> AddedMass:
        """
        Refer moments and rotations to O, and bring back what the code took to its stiffness.

        Parameters
        ----------
        surface_inertia : array, shape (2, 2), optional
            Integrals of x^2 dS, x y dS and y^2 dS over the mean free surface [m^4]; needed without
            `hydrostatic`.

        Raises
        ------
        InputError
            If the surface inertia is needed and not given.
        """
        matrix = self.matrix.copy()
        if not self.hydrostatic:
            if surface_inertia is None:
                raise InputError(
                    f'{self.source}: the hydrostatic part of the entries 44 and 55 is missing; '
                    'give the second moments of the mean free surface'
                )
            i_xx, i_yy = np.diag(surface_inertia)
            with np.errstate(divide='ignore'):
                matrix[:, 3, 3] -= self.density * GRAVITY * i_yy / self.omega**2
                matrix[:, 4, 4] -= self.density * GRAVITY * i_xx / self.omega**2
        x, y, z = self.reference
        # r_PO x: force at O makes the moment about O that it makes about P, and r_PO x F beside
        shift = np.eye(6)
        shift[3:, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
        if np.any(self.reference != 0.0):
            # an entry that is not there must not spoil those it does not reach
            known = np.where(np.isfinite(matrix), matrix, 0.0)
            reached = np.abs(shift) @ ~np.isfinite(matrix) @ np.abs(shift).T > 0.0
            matrix = np.where(reached, np.nan, shift @ known @ shift.T)
        return replace(self, matrix=matrix, reference=np.zeros(3), hydrostatic=True)
