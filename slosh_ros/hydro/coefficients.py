"""The common end of all routes: the modal coefficients of a liquid in a tank."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.tank import LiquidAtRest

Array = NDArray[np.float64]


_MOVED = 1e-9  # [-] share of the mass that counts as moved
_SURFACE_POINTS = 33  # along each side; odd, so that the centre lines are among them
_RADII, _ANGLES = 17, 48  # of a round surface; a multiple of 4 angles, so that crests are among


class Potentials(Protocol):
    """
    The velocity potentials of a liquid, anywhere in it and on its wall.

    Points are given about O in tank axes. What lies outside the liquid is nobody's business here.
    """

    def modes(self, points: Array) -> Array:
        """
        Potentials phi_j of the modes, equal to f_j on the mean free surface.

        Parameters
        ----------
        points : array, shape (p, 3)
            [m].

        Returns
        -------
        array, shape (p, n)
            [-].
        """

    def stokes_joukowski(self, points: Array) -> Array:
        """
        Potentials Omega_4, Omega_5, Omega_6 of rotation about O under a closed lid.

        Each has the mean zero over the free surface: Bernoulli's constant is then the same as of
        a liquid at rest.

        Parameters
        ----------
        points : array, shape (p, 3)
            [m].

        Returns
        -------
        array, shape (p, 3)
            [m^2].
        """


@dataclass(frozen=True, eq=False)
class ModalCoefficients:
    """
    Modal coefficients of the liquid in a tank, about O, the centre of the mean free surface.

    Tank axes: x forward, y left, z up. Modes stand by rising natural frequency. Their shapes f_j
    are scaled to max|f_j| = 1 on the mean free surface and are positive towards -x and -y, at the
    first crest or trough from there, so that lambda_1 < 0 for surge modes and lambda_2 < 0 for
    sway modes of symmetric tanks.

    Attributes
    ----------
    route : str
        How the coefficients were found.
    density : float
        Density of the liquid [kg/m^3].
    liquid : LiquidAtRest
        Geometry of the liquid at rest.
    names : tuple of str
        One name a mode: half-waves along x and y, as `x1`, `y3`, `x1y1`.
    omega : array, shape (n,)
        Natural frequencies [rad/s].
    mu : array, shape (n,)
        Modal masses, eq (10) [kg].
    coupling : array, shape (n, 6)
        lambda_1, lambda_2, 0 [kg] and lambda_4, lambda_5, lambda_6 [kg m], eqs (11)-(14).
    inertia_stokes_joukowski : array, shape (3, 3)
        Inertia of the liquid under a closed lid (Stokes-Joukowski) about O [kg m^2].
    wall_friction : array, shape (n,), or None
        Half the wall integral over the volume integral of the squared velocity of the mode,
        tangential at the wall [1/m]; None where the route does not give it.
    surface_points : array, shape (m, 2)
        Points x, y of the mean free surface at which the shapes are known [m].
    surface_shapes : array, shape (m, n)
        The mode shapes f_j there [-].
    surface_gaps : tuple of (float, float)
        From which y to which y there is a wall between pieces of the free surface [m].
    potentials : Potentials or None
        For pressures; None where the route does not give them.
    crests : array, shape (k, s, n), or None
        The mode shapes close together along k lines of the free surface, on which their largest
        moduli are; None: those of `surface_shapes` are the largest.
    error : float or None
        Estimated largest relative error of the frequencies and couplings, these over the largest
        of their kind unless they are fitted; None for routes that are exact or whose accuracy is
        known beforehand.
    """

    route: str
    density: float
    liquid: LiquidAtRest
    names: tuple[str, ...]
    omega: Array
    mu: Array
    coupling: Array
    inertia_stokes_joukowski: Array
    wall_friction: Array | None
    surface_points: Array
    surface_shapes: Array
    surface_gaps: tuple[tuple[float, float], ...] = ()
    potentials: Potentials | None = None
    crests: Array | None = None
    error: float | None = None

    @property
    def mass(self) -> float:
        """Mass of the liquid [kg]."""
        return self.density * self.liquid.volume

    @property
    def inertia_frozen(self) -> Array:
        """Inertia of the frozen liquid about O [kg m^2], shape (3, 3)."""
        return self.density * self.liquid.inertia

    @property
    def static_residual(self) -> Array:
        """
        Part of the hydrostatic moment that the modes kept here do not carry, (2, 2) [kg m].

        The surface moments rho I_xx, rho I_xy, rho I_yy less their modal sums
        g lambda_i lambda_k/(mu omega^2): zero with all modes (Parseval, THEORY 2.2).
        """
        force = self.coupling[:, :2]
        modal = (force.T * (GRAVITY / (self.mu * self.omega**2))) @ force
        return np.asarray(self.density * self.liquid.surface_inertia - modal)

    @property
    def mass_moved(self) -> Array:
        """Mass m_j that each mode moves fore-aft or sideways, shape (n,) [kg] (THEORY 1)."""
        return np.asarray(np.sum(self.coupling[:, :2] ** 2, axis=1) / self.mu)

    @property
    def lever(self) -> Array:
        """
        Height of that mass above O, shape (n,) [m]; NaN of a mode that only turns the liquid.

        lambda_5/lambda_1 of what surges, -lambda_4/lambda_2 of what sways.
        """
        surge, sway, roll, pitch = self.coupling[:, [0, 1, 3, 4]].T
        pushed = self.mass_moved > _MOVED * self.mass
        square = np.where(pushed, surge**2 + sway**2, 1.0)
        return np.asarray(np.where(pushed, (surge * pitch - sway * roll) / square, np.nan))

    def weighing(self, density: float) -> ModalCoefficients:
        """Return those of a liquid of another density [kg/m^3]."""
        times = density / self.density
        return replace(
            self,
            density=density,
            mu=times * self.mu,
            coupling=times * self.coupling,
            inertia_stokes_joukowski=times * self.inertia_stokes_joukowski,
        )

    def turned(self, sign: Array) -> ModalCoefficients:
        """Return the same modes with shapes of other signs, (n,), without crests."""
        potentials = None if self.potentials is None else _Turned(self.potentials, sign)
        return replace(
            self,
            coupling=self.coupling * sign[:, np.newaxis],
            surface_shapes=self.surface_shapes * sign,
            potentials=potentials,
            crests=None,
        )

    def wall_damping_ratio(self, kinematic_viscosity: float) -> Array:
        """
        Damping ratios by laminar boundary layers at the walls of a smooth bare tank, shape (n,).

        Dissipation of Stokes's layer at each point of the wall over the energy of the mode
        (Keulegan 1959, J. Fluid Mech. 6; Case & Parkinson 1957, J. Fluid Mech. 2). A lower bound:
        contaminated surfaces, contact lines and all that is built into a tank add to it.

        Parameters
        ----------
        kinematic_viscosity : float
            Of the liquid [m^2/s]; its boundary layer must be thin against the tank.

        Raises
        ------
        InputError
            If this route does not know the velocity at the wall.
        """
        if self.wall_friction is None:
            raise InputError(
                f'the route "{self.route}" gives no damping; write a damping_ratio instead of '
                'the kinematic_viscosity'
            )
        return self.wall_friction * np.sqrt(kinematic_viscosity / (2.0 * self.omega))


@dataclass(frozen=True, eq=False)
class _Turned:
    """Potentials of modes with other signs."""

    potentials: Potentials
    sign: Array

    def modes(self, points: Array) -> Array:
        return self.potentials.modes(points) * self.sign

    def stokes_joukowski(self, points: Array) -> Array:
        return self.potentials.stokes_joukowski(points)


def still_coefficients(
    route: str,
    density: float,
    liquid: LiquidAtRest,
    inertia_stokes_joukowski: Array,
    potentials: Potentials | None,
) -> ModalCoefficients:
    """
    Coefficients, without modes, of a liquid that has no free surface.

    Parameters
    ----------
    route : str
        How they were found.
    density : float
        [kg/m^3].
    liquid : LiquidAtRest
        Of a tank that is empty or full.
    inertia_stokes_joukowski : array, shape (3, 3)
        Of the liquid in the closed tank about O [kg m^2].
    potentials : Potentials or None
        Of its rotation; Bernoulli's constant is that of O, where a full tank is vented.
    """
    return ModalCoefficients(
        route=route,
        density=density,
        liquid=liquid,
        names=(),
        omega=np.zeros(0),
        mu=np.zeros(0),
        coupling=np.zeros((0, 6)),
        inertia_stokes_joukowski=inertia_stokes_joukowski,
        wall_friction=np.zeros(0),
        surface_points=np.zeros((0, 2)),
        surface_shapes=np.zeros((0, 0)),
        potentials=potentials,
    )


def mode_name(a: int, b: int) -> str:
    """Name a mode by its half-waves along x and across y: `x1`, `y3`, `x1y1`."""
    return (f'x{a}' if a else '') + (f'y{b}' if b else '')


def mode_numbers(name: str) -> tuple[int, int]:
    """Half-waves along x and across y of a mode of this name."""
    along, _, across = name.removeprefix('x').partition('y')
    return int(along or 0), int(across or 0)


def surface_grid(length: float, width: float) -> Array:
    """Points of a rectangular mean free surface, edges included, shape (m, 2) [m]."""
    x, y = (np.linspace(-side / 2.0, side / 2.0, _SURFACE_POINTS) for side in (length, width))
    return np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)


def diametral_names(modes: int) -> tuple[str, ...]:
    """Name the modes of one nodal diameter, in pairs `x1`, `y1`, `x3`, `y3`, ..."""
    return tuple(
        # across the diameter the n-th radial shape has 2n - 1 half-waves
        mode_name(j, 0) if j % 2 else mode_name(0, j - 1)
        for j in range(1, modes + 1)
    )


def disc_points(radius: float) -> Array:
    """Points of a circular mean free surface, centre and edge included, shape (m, 2) [m]."""
    r = np.linspace(0.0, radius, _RADII)[1:]
    theta = 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
    rings = np.stack([np.outer(r, np.cos(theta)), np.outer(r, np.sin(theta))], axis=-1)
    return np.concatenate([np.zeros((1, 2)), rings.reshape(-1, 2)])


def peaks(samples: Array) -> Array:
    """Largest modulus in each column, refined by the parabola through the three samples there."""
    # beyond the ends the columns are mirrored: a peak at an end stays as it is
    modulus = np.pad(np.abs(samples), ((1, 1), (0, 0)), mode='reflect')
    top, column = modulus[1:-1].argmax(axis=0), np.arange(modulus.shape[1])
    before, peak, after = (modulus[top + i, column] for i in range(3))
    bend = np.maximum(2.0 * peak - before - after, np.finfo(float).tiny)
    refined: Array = peak + (after - before) ** 2 / (8.0 * bend)
    return refined
