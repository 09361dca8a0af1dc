"""Which route leads from a tank to its coefficients."""

from __future__ import annotations

from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.tank import Rectangle, UniformTank


def coefficients_of(
    tank: UniformTank, depth: float, density: float, modes: int
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    Parameters
    ----------
    tank : UniformTank
        The tank.
    depth : float
        Depth of the liquid [m].
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes.
    """
    if isinstance(tank.section, Rectangle):
        return rectangular_coefficients(tank, depth, density, modes)
    # scikit-fem takes a while to import; a rectangular tank does without
    from slosh_ros.hydro.section import section_coefficients

    return section_coefficients(tank, depth, density, modes)
