"""The tank of the configuration's `shape: added_mass`: a file of added mass and what it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.added_mass_files import read_added_mass
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.fit import FittedFamily, fit_liquid, fitted_coefficients
from slosh_ros.tank import KnownLiquid, LiquidAtRest

Array = NDArray[np.float64]

OFF_CENTRE = 1e-3  # of the surface's extents, by which the centroid may lie beside O
INERTIA_TOLERANCE = 0.05  # by which a liquid under a lid may be harder to turn than the frozen one


@dataclass(frozen=True, eq=False)
class AddedMassTank(KnownLiquid):
    """
    A liquid whose added mass over frequency is known.

    Parameters
    ----------
    data : AddedMass
        Its added mass.
    plan : tuple of float
        Length (x) and width (y) of the mean free surface [m].
    """

    data: AddedMass
    plan: tuple[float, float]

    @cached_property
    def families(self) -> tuple[FittedFamily, ...]:
        """
        Modes of surge, sway and perhaps yaw, with what the fit tells of itself.

        Raises
        ------
        InputError
            If liquid and data do not fit each other; see :func:`~slosh_ros.hydro.fit.fit_liquid`.
        """
        return fit_liquid(self.data, self.liquid)

    def coefficients(self, modes: int) -> ModalCoefficients:
        """
        Coefficients of the modes of lowest frequency.

        Parameters
        ----------
        modes : int
            Most modes to keep.

        Raises
        ------
        InputError
            If liquid and data do not fit each other.
        """
        found = fitted_coefficients(self.data, self.liquid, self.families, modes, self.plan)
        frozen = np.diag(found.inertia_frozen)
        lid = np.diag(found.inertia_stokes_joukowski)
        for axis, solid, closed in zip(('roll', 'pitch', 'yaw'), frozen, lid, strict=True):
            if closed > (1.0 + INERTIA_TOLERANCE) * solid:
                raise InputError(
                    f'{self.data.source}: under a lid the liquid would have an inertia in {axis} '
                    f'of {closed:.4g} kg m^2 about O, more than the {solid:.4g} kg m^2 that it '
                    'has frozen; check liquid_inertia and added_mass_hydrostatic'
                )
            # of the mass at its centroid, none; a body of revolution turns without its liquid
            arm = found.mass * float(self.liquid.centroid[2]) ** 2 if axis != 'yaw' else 0.0
            if closed < arm - INERTIA_TOLERANCE * solid:
                raise InputError(
                    f'{self.data.source}: under a lid the liquid would have an inertia in {axis} '
                    f'of {closed:.4g} kg m^2 about O, less than the {arm:.4g} kg m^2 of all its '
                    'mass at its centroid; check added_mass_hydrostatic'
                )
        return found


def added_mass_tank(
    added_mass_file: str,
    density: float,
    liquid_mass: float,
    liquid_depth: float,
    liquid_centroid: Sequence[float],
    liquid_inertia: Sequence[float],
    surface_centre: Sequence[float],
    surface_length: float,
    surface_width: float,
    freeboard: float,
    tank_volume: float,
    surface_moments: Sequence[float] | None = None,
    added_mass_reference: Sequence[float] | None = None,
    added_mass_surface_centre: Sequence[float] = (0.0, 0.0, 0.0),
    added_mass_length_scale: float | None = None,
    added_mass_first_column: str = 'period',
    added_mass_hydrostatic: bool | None = None,
) -> AddedMassTank:
    """
    Read a file and put what it lacks beside it.

    Parameters
    ----------
    added_mass_file : str
        WAMIT `.1`, Capytaine `.nc`, BEMIO `.h5`.
    density : float
        Of the liquid [kg/m^3]; held against the file's.
    liquid_mass : float
        [kg]; held against the file's at rest.
    liquid_depth : float
        Greatest depth [m].
    liquid_centroid : sequence of float
        In the tank frame [m].
    liquid_inertia : sequence of float
        Of the frozen liquid about its centroid: roll, pitch, yaw [kg m^2].
    surface_centre : sequence of float
        O, the centre of the mean free surface, in the tank frame [m].
    surface_length, surface_width : float
        Extents of the mean free surface along x and y [m].
    freeboard : float
        Height of the roof above the mean free surface [m].
    tank_volume : float
        Of the whole tank [m^3].
    surface_moments : sequence of float, optional
        Integrals of x^2 dS and y^2 dS over the surface about O [m^4]; those of a rectangle.
    added_mass_reference : sequence of float, optional
        Point of the moments in the axes of the file [m]; needed for `.1`.
    added_mass_surface_centre : sequence of float
        O in the axes of the file [m].
    added_mass_length_scale : float, optional
        ULEN [m]; needed for `.1`.
    added_mass_first_column : str
        Of a `.1`: `period` or `frequency`.
    added_mass_hydrostatic : bool, optional
        See :class:`~slosh_ros.hydro.added_mass.AddedMass`.

    Raises
    ------
    InputError
        If something does not fit; the message begins with the name of the parameter.
    """
    path = Path(added_mass_file)
    if path.suffix.lower() in ('.nc', '.h5', '.hdf5'):
        for key, foreign in (
            ('length_scale', added_mass_length_scale is not None),
            ('first_column', added_mass_first_column != 'period'),
        ):
            if foreign:
                raise InputError(
                    f'added_mass_{key} is given, but it is of the .1 of WAMIT, and '
                    f'added_mass_file is {path.name}; remove it'
                )
    if path.suffix.lower() == '.1':
        for key, value, what in (
            ('length_scale', added_mass_length_scale, 'length ULEN'),
            ('reference', added_mass_reference, 'reference point XBODY'),
        ):
            if value is None:
                raise InputError(
                    f'added_mass_{key} is missing; a file of WAMIT does not hold its {what}'
                )
    moments = surface_moments or (
        surface_length**3 * surface_width / 12.0,
        surface_length * surface_width**3 / 12.0,
    )
    if len(moments) != 2 or min(moments) <= 0.0:
        raise InputError(
            f'surface_moments is {list(moments)}; it takes two positive numbers, the integrals of '
            'x^2 dS and y^2 dS [m^4]'
        )
    volume = liquid_mass / density
    if not volume < tank_volume:
        raise InputError(
            f'tank_volume is {tank_volume:g} m^3, but the liquid alone takes {volume:.4g} m^3'
        )
    centroid = np.subtract(liquid_centroid, surface_centre)
    off = OFF_CENTRE * np.array([surface_length, surface_width])
    if np.any(np.abs(centroid[:2]) > off) or not -liquid_depth < centroid[2] < 0.0:
        raise InputError(
            f'liquid_centroid is {centroid.tolist()} m from the centre of the mean free surface; '
            'it must lie straight below it and above the bottom: the tank is to be symmetric '
            'fore and aft and to both sides'
        )
    roll, pitch, yaw = liquid_inertia
    if min(liquid_inertia) <= 0.0 or max(liquid_inertia) > sum(liquid_inertia) / 2.0:
        raise InputError(
            f'liquid_inertia is {roll:g}, {pitch:g}, {yaw:g} kg m^2, which no body has; each must '
            'be positive and none greater than the two others together'
        )
    arm = volume * float(centroid[2]) ** 2
    liquid = LiquidAtRest(
        depth=liquid_depth,
        fill_ratio=volume / tank_volume,
        volume=volume,
        surface_centre=np.asarray(surface_centre, dtype=float),
        freeboard=freeboard,
        centroid=np.array([0.0, 0.0, centroid[2]]),
        inertia=np.diag([roll / density + arm, pitch / density + arm, yaw / density]),
        surface_inertia=np.diag(moments),
    )
    try:
        data = read_added_mass(
            path,
            density=density,
            reference=added_mass_reference,
            length_scale=added_mass_length_scale,
            surface_centre=added_mass_surface_centre,
            hydrostatic=added_mass_hydrostatic,
            first_column=added_mass_first_column,
        )
    except InputError as error:
        raise InputError(f'added_mass_file: {error}') from error
    return AddedMassTank(liquid, tank_volume, data, (surface_length, surface_width))
