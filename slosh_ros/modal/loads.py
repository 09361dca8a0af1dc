"""
Force and moment of the liquid on the tank (THEORY 2.2).

All loads are linear in the modal coordinates, their rates and the acceleration (s, alpha) of O,
so four constant matrices hold them. A wrench is force and moment stacked, shape (6,); an
acceleration is specific force and angular acceleration stacked, shape (6,).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import ModalCoefficients

Array = NDArray[np.float64]


def cross_matrix(r: Array) -> Array:
    """Return the matrix [r x] of the vector product from the left, shape (3, 3)."""
    x, y, z = r
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def wrench_transform(rotation: Array, origin: Array) -> Array:
    """
    Matrix that refers a wrench to another frame.

    Parameters
    ----------
    rotation : array, shape (3, 3)
        Takes vectors from the old axes to the new.
    origin : array, shape (3,)
        Old reference point in the new frame [m].

    Returns
    -------
    array, shape (6, 6)
        Its transpose takes accelerations from the new frame to the old (velocity squares aside).
    """
    zero = np.zeros((3, 3))
    return np.block([[rotation, zero], [cross_matrix(origin) @ rotation, rotation]])


def rigid_matrix(mass: float, centre: Array, inertia: Array) -> Array:
    """
    Matrix of the weight and inertia with which a rigid body loads what carries it.

    Parameters
    ----------
    mass : float
        [kg].
    centre : array, shape (3,)
        Mass centre [m].
    inertia : array, shape (3, 3)
        About the origin [kg m^2].

    Returns
    -------
    array, shape (6, 6)
        Wrench about the origin per acceleration (s, alpha) of the origin.
    """
    arm = mass * cross_matrix(centre)
    return -np.block([[mass * np.eye(3), -arm], [arm, inertia]])


@dataclass(frozen=True, eq=False)
class LoadMatrices:
    """
    Matrices of the liquid's loads, wrench about O in tank axes unless moved.

    Attributes
    ----------
    stiffness, damping : array, shape (6, n)
        Wrench per modal coordinate and per modal velocity, without feed-through.
    coupling : array, shape (6, 6)
        Sloshing wrench per acceleration: sum of lambda lambda^T / mu.
    rigid : array, shape (6, 6)
        Wrench of weight and inertia per acceleration, with the Stokes-Joukowski inertia and the
        hydrostatic moment of the modes that are not kept.
    """

    stiffness: Array
    damping: Array
    coupling: Array
    rigid: Array

    @classmethod
    def of(cls, coefficients: ModalCoefficients, damping_ratio: Array) -> LoadMatrices:
        """Build the matrices of a liquid with the given damping ratio per mode."""
        c = coefficients
        lambdas = c.coupling.T
        # beta'' = -omega^2 beta - 2 zeta omega beta' - (lambda . acceleration)/mu in eqs (15)-(20)
        stiffness = lambdas * c.omega**2
        stiffness[3] -= GRAVITY * lambdas[1]
        stiffness[4] += GRAVITY * lambdas[0]
        rigid = rigid_matrix(c.mass, c.liquid.centroid, c.inertia_stokes_joukowski)
        rigid[3, :2] += c.static_residual[1]
        rigid[4, :2] -= c.static_residual[0]
        return cls(
            stiffness=stiffness,
            damping=lambdas * (2.0 * damping_ratio * c.omega),
            coupling=(lambdas / c.mu) @ lambdas.T,
            rigid=rigid,
        )

    def moved(self, transform: Array) -> LoadMatrices:
        """Refer the wrenches to another frame; accelerations stay those of O in tank axes."""
        return LoadMatrices(
            *(transform @ m for m in (self.stiffness, self.damping, self.coupling, self.rigid))
        )

    def state(self, beta: Array, beta_rate: Array) -> Array:
        """Sloshing wrench without feed-through: what it is when the tank does not accelerate."""
        wrench: Array = self.stiffness @ beta + self.damping @ beta_rate
        return wrench
