"""
Added mass of a sloshing liquid over frequency, eqs (25)-(36).

Motion eta, force and moment vary as exp(-i omega t). The force is -A eta'', so that Im A >= 0
dissipates, and A + i B/omega holds added mass A and radiation damping B of other codes in one
complex matrix. Everything is about O, the centre of the mean free surface, in tank axes.

One mode's part is q q^T G/mu with

    q = (lambda_1, lambda_2, 0, lambda_4 - g lambda_2/omega^2, lambda_5 + g lambda_1/omega^2,
         lambda_6),  G = omega^2/(omega_m^2 - omega^2),

whose entries 11, 22, 15, 24 are eqs (32)-(35). With p = (0, 0, 0, -lambda_2, lambda_1, 0) it is

    (lambda lambda^T G + g (lambda p^T + p lambda^T) G/omega^2 + g^2 p p^T G/omega^4)/mu.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import Array, ModalCoefficients
from slosh_ros.tank import Rectangle, UniformTank

ComplexArray = NDArray[np.complex128]


def modal_added_mass(
    coefficients: ModalCoefficients,
    omega: ArrayLike,
    damping: float = 0.0,
    wall_ratio: Array | None = None,
) -> ComplexArray:
    """
    Return the added mass of the sloshing modes alone, eqs (32)-(35) and all other entries.

    Parameters
    ----------
    coefficients : ModalCoefficients
        The modes.
    omega : array_like, shape (n,)
        Frequencies [rad/s], 0 and infinity among them if wanted. At 0 the entries 44, 55 (and 45)
        are infinite: they hold the weight of the inclined surface over omega^2.
    damping : float
        The paper's artificial damping epsilon on the walls, eq (36), to first order [-]: right
        near the natural frequencies, far above them not.
    wall_ratio : array, shape (m,), optional
        Integral of phi^2 over the wetted walls over that of f^2 over the free surface, per mode
        [-]; needed with `damping`. :func:`rectangular_wall_ratio` has it for a rectangle.

    Returns
    -------
    array of complex, shape (n, 6, 6)
        Added mass [kg, kg m, kg m^2].
    """
    c = coefficients
    x = np.atleast_1d(np.asarray(omega, dtype=float)) ** 2
    g_lambda = GRAVITY * c.coupling[:, [1, 0]] * [-1.0, 1.0]
    weight = np.zeros((6, 6))
    weight[3:5, 3:5] = (g_lambda.T / (c.mu * c.omega**2)) @ g_lambda
    return _bounded(c, x, damping, wall_ratio) + _over(weight, x)


def total_added_mass(
    coefficients: ModalCoefficients,
    omega: ArrayLike,
    damping: float = 0.0,
    wall_ratio: Array | None = None,
    hydrostatic: bool = True,
) -> ComplexArray:
    """
    Return the added mass of the whole liquid, as a boundary element code returns it from eq (31).

    To the modes it adds the liquid under a closed lid (mass, first moments, Stokes-Joukowski
    inertia) and the hydrostatic moment of the modes that are not kept, which follow at once.

    Parameters
    ----------
    coefficients : ModalCoefficients
        The modes.
    omega : array_like, shape (n,)
        Frequencies [rad/s], 0 and infinity among them if wanted.
    damping : float
        The paper's artificial damping epsilon on the walls, eq (36), to first order [-]: right
        near the natural frequencies, far above them not.
    wall_ratio : array, shape (m,), optional
        See :func:`modal_added_mass`.
    hydrostatic : bool
        The added mass comes from the radiation potential alone, eq (31), so that all of it is
        finite at 0. False: the code has taken the term -rho g (I_yy, I_xx)/omega^2 of 44 and 55
        over to its hydrostatic stiffness.

    Returns
    -------
    array of complex, shape (n, 6, 6)
        Added mass [kg, kg m, kg m^2].
    """
    c = coefficients
    x = np.atleast_1d(np.asarray(omega, dtype=float)) ** 2
    total = _bounded(c, x, damping, wall_ratio) + _under_lid(c)
    if hydrostatic:
        return total
    i_xx, i_yy = np.diag(c.liquid.surface_inertia)
    return total + _over(c.density * GRAVITY * np.diag([0.0, 0.0, 0.0, i_yy, i_xx, 0.0]), x)


def rectangular_wall_ratio(tank: UniformTank, depth: float, names: tuple[str, ...]) -> Array:
    """
    Integral of phi^2 over the wetted walls over that of f^2 over the free surface, closed form.

    Times the epsilon of eq (36) it is the loss factor of a mode, twice its damping ratio
    (THEORY 5).

    Parameters
    ----------
    tank : UniformTank
        Of rectangular section.
    depth : float
        Depth of the liquid [m].
    names : tuple of str
        Names of the modes, `x1`, `y3`, `x1y1`, ...

    Returns
    -------
    array, shape (m,)
        The ratios [-].

    Raises
    ------
    TypeError
        If the section is not a rectangle.
    """
    if not isinstance(tank.section, Rectangle):
        raise TypeError('the closed form needs a rectangular section')
    a, b = np.array([_half_waves(name) for name in names], dtype=float).reshape(-1, 2).T
    length, width = tank.length, tank.section.width
    kd = np.pi * np.hypot(a / length, b / width) * depth
    # mean squares of the shape along and across: 1/2 of a wave, 1 of a constant
    along, across = np.where(a > 0, 0.5, 1.0), np.where(b > 0, 0.5, 1.0)
    # integral of cosh^2 k(z + d)/cosh^2 kd over the depth, without overflow
    down = depth / 2.0 * (1.0 / np.cosh(np.minimum(kd, 300.0)) ** 2 + np.tanh(kd) / kd)
    bottom = 1.0 / np.cosh(np.minimum(kd, 300.0)) ** 2
    return 2.0 * down / (length * along) + 2.0 * down / (width * across) + bottom


def _half_waves(name: str) -> tuple[int, int]:
    """Half-waves along x and y of `x1`, `y3`, `x1y1`."""
    x, _, y = name.partition('y')
    return int(x[1:] or 0), int(y or 0)


def _bounded(
    c: ModalCoefficients, x: Array, damping: float, wall_ratio: Array | None
) -> ComplexArray:
    """
    Sum over the modes, less g^2 p p^T/(mu omega_m^2 omega^2), which is unbounded at omega = 0.

    With damping, omega_m^2 - omega^2 becomes omega_m^2 - omega^2 (1 + i epsilon S_m).
    """
    if damping and wall_ratio is None:
        raise TypeError('damping needs the wall_ratio of each mode')
    loss = 1.0 + 1j * damping * (np.zeros(len(c.mu)) if wall_ratio is None else wall_ratio)
    infinite = np.isinf(x)[:, np.newaxis]
    finite_x = np.where(infinite, 0.0, x[:, np.newaxis])
    over_square = np.where(infinite, 0.0, 1.0 / (c.omega**2 - finite_x * loss))  # G/omega^2
    response = np.where(infinite, -1.0 / loss, finite_x * over_square)  # G
    remainder = over_square * loss / c.omega**2  # (G - omega^2/omega_m^2)/omega^4

    lambdas, tilt = c.coupling, np.zeros_like(c.coupling)
    tilt[:, 3], tilt[:, 4] = -GRAVITY * lambdas[:, 1], GRAVITY * lambdas[:, 0]
    total: ComplexArray = sum(
        np.einsum('nm,mi,mj->nij', factor / c.mu, left, right, optimize=True)
        for factor, left, right in (
            (response, lambdas, lambdas),
            (over_square, lambdas, tilt),
            (over_square, tilt, lambdas),
            (remainder, tilt, tilt),
        )
    )
    return total


def _over(weight: Array, x: Array) -> Array:
    """Divide a matrix by each omega^2; its zeros stay zero at omega = 0. Shape (n, 6, 6)."""
    with np.errstate(divide='ignore', invalid='ignore'):
        quotient = weight / x[:, np.newaxis, np.newaxis]
    return np.where(weight != 0.0, quotient, 0.0)


def _under_lid(c: ModalCoefficients) -> Array:
    """Inertia of the liquid under a closed lid, with the moment of the modes not kept, (6, 6)."""
    x, y, z = c.mass * c.liquid.centroid
    arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    inertia = np.block([[c.mass * np.eye(3), -arm], [arm, c.inertia_stokes_joukowski]])
    surge, sway = np.diag(c.static_residual)
    inertia[[0, 4], [4, 0]] += surge
    inertia[[1, 3], [3, 1]] -= sway
    return inertia
