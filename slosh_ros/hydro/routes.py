"""
Which route leads from a tank to its coefficients.

What a route stands on takes half of a node's start-up to import, so it is imported when taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np

from slosh_ros.hydro.added_mass_tank import AddedMassTank
from slosh_ros.hydro.coefficients import ModalCoefficients, still_coefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.tank import (
    Capsule,
    Circle,
    KnownLiquid,
    LiquidAtRest,
    MeshTank,
    Rectangle,
    Tank,
    UniformTank,
    UprightCylinder,
)


def by_volume(tank: Tank) -> TypeGuard[Capsule | MeshTank]:
    """Whether a tank is one of any shape, whose liquid takes the 3-D route."""
    return isinstance(tank, MeshTank) or (isinstance(tank, Capsule) and not tank.is_sphere)


def coefficients_of(
    tank: Tank, depth: float, density: float, modes: int | Sequence[str]
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency, or of those that are named.

    Parameters
    ----------
    tank : Tank
        The tank.
    depth : float
        Depth of the liquid [m]; an empty tank and a full one have no modes.
    density : float
        Density of the liquid [kg/m^3].
    modes : int or sequence of str
        Number of modes, or the names of modes that are found at some other fill.
    """
    if depth == 0.0:
        nothing = LiquidAtRest.none(tank.height)
        return still_coefficients('empty', density, nothing, np.zeros((3, 3)), None)
    # of upright walls and of spheres the lowest modes are the same ones at any fill
    count = modes if isinstance(modes, int) else len(modes)
    if isinstance(tank, KnownLiquid):
        if not isinstance(tank, AddedMassTank):
            raise TypeError('nothing is known of the waves of this liquid')
        tank.filled(depth)
        return tank.coefficients(count)
    if isinstance(tank, UprightCylinder):
        from slosh_ros.hydro.cylinder_z import cylinder_z_coefficients

        return cylinder_z_coefficients(tank, depth, density, count)
    if by_volume(tank):
        from slosh_ros.hydro.volume import full_volume_coefficients, volume_coefficients

        if depth == tank.height:
            return full_volume_coefficients(tank, depth, density)
        return volume_coefficients(tank, depth, density, count)
    if isinstance(tank, Capsule):
        from slosh_ros.hydro.axisymmetric import axisymmetric_coefficients, full_sphere

        liquid = tank.filled(depth)
        if depth == tank.height:
            return full_sphere(tank.radius, liquid, density)
        return axisymmetric_coefficients(Circle(tank.radius), liquid, density, count)
    assert isinstance(tank, UniformTank)
    if isinstance(tank.section, Rectangle):
        return rectangular_coefficients(tank, depth, density, count)
    from slosh_ros.hydro.section import section_coefficients

    return section_coefficients(tank, depth, density, modes)
