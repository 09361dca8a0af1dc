"""Which route leads from a tank to its coefficients."""

from __future__ import annotations

from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.cylinder_z import cylinder_z_coefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.tank import Rectangle, Tank, UprightCylinder


def coefficients_of(tank: Tank, depth: float, density: float, modes: int) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    tank : UniformTank or UprightCylinder
        The tank.
    depth : float
        Depth of the liquid [m].
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes.
    """
    if isinstance(tank, UprightCylinder):
        return cylinder_z_coefficients(tank, depth, density, modes)
    if isinstance(tank.section, Rectangle):
        return rectangular_coefficients(tank, depth, density, modes)
    return section_coefficients(tank, depth, density, modes)
