"""
Damping ratios by published formulas.

A smooth bare tank damps in the boundary layers of its walls. Where somebody has measured it, his
formula is the default: it holds what theory lacks (contact line, contaminated surface). Elsewhere
it is the dissipation of Stokes's layer, mode by mode, from the solved velocities at the wall.

* `mikishev_dorozhkin`, upright cylinders: G. N. Mikishev & N. Ya. Dorozhkin (1961).
* `stephens`, upright cylinders: Stephens, Leonard & Perry, NASA TN D-1367 (1962).
* `stofan_sumner`, spheres: Sumner & Stofan, NASA TN D-1991 (1963).
* `boundary_layer`, all shapes whose route tells the velocity at the wall (Keulegan 1959,
  J. Fluid Mech. 6; Case & Parkinson 1957, J. Fluid Mech. 2): rectangular tanks, uniform sections,
  horizontal cylinders among them. For these no measured formula was found that could be confirmed.
* Ring baffles in upright cylinders: Miles (1958), J. Appl. Mech. 25, with the constants of NASA
  SP-8031 (1969); several rings add up (Bauer 1962, NASA TM X-50183).

How sure that is. No original was at hand. The constants of the measured formulas and of rings are
second-hand, as later literature has them after NASA SP-106 (Abramson 1966, ch. 4) and Dodge
(2000). Of Miles's paper its abstract was read: a "rough analysis", of "moderate amplitudes",
damping as the root of the amplitude and as the ring's area to 3/2; that is the form taken here.

Where they hold. All: small waves, laminar layers, one clean liquid that does not turn, gravity
large against surface tension. The measured ones were fitted to models of the laboratory; the
range of their viscosity parameters was not found in what could be read, nor that of width and
depth of rings. The code checks the shape, that the ratio stays below `MAX_WALL_DAMPING`, and of
rings that they fit into the tank and are wet below the wave; nothing else of this. Two formulas
for the cylinder stand here so that their difference shows what such numbers are worth.

The measured formulas are of the lowest mode. Higher modes take its ratio times what the boundary
layers of theory make of theirs over that of the lowest; the same ratio where the route does not
tell. Rings act on the lowest modes alone: the depth at which they hang is deep for all others. No
formula for longitudinal baffles is here, for none could be confirmed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.tank import Tank, UprightCylinder

Array = NDArray[np.float64]

MAX_WALL_DAMPING = 0.1  # beyond it the boundary layers are not thin
FIRST_ROOT = 1.84  # of J_1', to the digits of the formulas


class Damping(NamedTuple):
    """
    Damping ratios and where they come from.

    Attributes
    ----------
    ratio : array, shape (n,)
        Of every mode [-].
    source : str
        For people.
    """

    ratio: Array
    source: str


@dataclass(frozen=True)
class RingBaffles:
    """
    Flat rings at the wall of an upright cylinder.

    Parameters
    ----------
    width : float
        Of the rings [m].
    heights : tuple of float
        Their z in the tank frame [m].
    wave : float
        Height of the wave at the wall at which they damp [m]: their damping grows with its root,
        and one value of it is taken for all motion.
    """

    width: float
    heights: tuple[float, ...]
    wave: float


def mikishev_dorozhkin(radius: float, depth: float, viscosity: float) -> float:
    """
    Damping ratio of the first mode in a smooth upright cylinder, 4.98/2 pi = 0.79.

    Parameters
    ----------
    radius, depth : float
        Of the liquid [m].
    viscosity : float
        Kinematic [m^2/s].
    """
    h = depth / radius
    wave = FIRST_ROOT * h
    bottom = 0.318 / np.sinh(wave) * (1.0 + (1.0 - h) / np.cosh(wave)) if wave < 300.0 else 0.0
    return 4.98 / (2.0 * np.pi) * _viscosity_root(radius, viscosity) * (1.0 + float(bottom))


def stephens(radius: float, depth: float, viscosity: float) -> float:
    """
    Damping ratio of the first mode in a smooth upright cylinder; see `mikishev_dorozhkin`.

    Parameters
    ----------
    radius, depth : float
        Of the liquid [m].
    viscosity : float
        Kinematic [m^2/s].
    """
    h = depth / radius
    wave = FIRST_ROOT * h
    bottom = 2.0 * (1.0 - h) / np.sinh(2.0 * wave) if wave < 300.0 else 0.0
    rise = np.tanh(wave) ** -0.25
    return 5.23 / (2.0 * np.pi) * _viscosity_root(radius, viscosity) * float(rise * (1.0 + bottom))


def stofan_sumner(radius: float, depth: float, viscosity: float) -> float:
    """
    Damping ratio of the first mode in a smooth sphere.

    The logarithmic decrement is 0.131 B^0.359 R/h up to half full, with the viscosity parameter
    B = 10^4 nu/sqrt(g D^3), and 0.131 B^0.359 (1 + 0.46 (2 - h/R))/(1.46 (2 - h/R)) above.

    Parameters
    ----------
    radius, depth : float
        Of sphere and liquid [m].
    viscosity : float
        Kinematic [m^2/s].
    """
    h = depth / radius
    parameter = 1e4 * viscosity / np.sqrt(GRAVITY * (2.0 * radius) ** 3)
    fill = 1.0 / h if h <= 1.0 else (1.0 + 0.46 * (2.0 - h)) / (1.46 * (2.0 - h))
    return float(0.131 * parameter**0.359 * fill / (2.0 * np.pi))


def ring_damping(radius: float, width: float, depths: Array, wave: float) -> float:
    """
    Damping ratio that rings add to the first mode in an upright cylinder.

    Sum of 2.83 exp(-4.60 d/R) alpha^1.5 sqrt(eta/R) over the rings, alpha the part of the cross
    section that they take.

    Parameters
    ----------
    radius, width : float
        Of the tank and of the rings [m].
    depths : array, shape (n,)
        Of the rings below the mean free surface [m].
    wave : float
        Height eta of the wave at the wall [m].
    """
    share = width / radius
    blocked = share * (2.0 - share)
    near = float(np.sum(np.exp(-4.60 * depths / radius)))
    return float(2.83 * near * blocked**1.5 * np.sqrt(wave / radius))


class _Fit(NamedTuple):
    source: str
    shape: str
    ratio: Callable[[float, float, float], float]


FITS = {
    'mikishev_dorozhkin': _Fit(
        'Mikishev & Dorozhkin (1961), NASA SP-106, smooth upright cylinder',
        'cylinder_z',
        mikishev_dorozhkin,
    ),
    'stephens': _Fit(
        'Stephens, Leonard & Perry (1962), NASA TN D-1367, smooth upright cylinder',
        'cylinder_z',
        stephens,
    ),
    'stofan_sumner': _Fit(
        'Sumner & Stofan (1963), NASA TN D-1991, smooth sphere', 'sphere', stofan_sumner
    ),
}
FORMULAS = ('automatic', 'boundary_layer', *FITS)
_DEFAULT = {'cylinder_z': 'mikishev_dorozhkin', 'sphere': 'stofan_sumner'}


def viscous_damping(
    tank: Tank, coefficients: ModalCoefficients, viscosity: float, formula: str = 'automatic'
) -> Damping:
    """
    Damping of a smooth bare tank.

    Parameters
    ----------
    tank : Tank
        The tank.
    coefficients : ModalCoefficients
        Of the liquid in it.
    viscosity : float
        Kinematic [m^2/s].
    formula : str
        One of `FORMULAS`; `automatic` takes the measured one of the shape, else the boundary
        layers.

    Raises
    ------
    InputError
        If the formula is of another shape, the route does not know the velocity at the wall, or
        the liquid is too thick for thin boundary layers.
    """
    if formula == 'automatic':
        formula = _DEFAULT.get(tank.shape, 'boundary_layer')
    c = coefficients
    if formula == 'boundary_layer':
        if c.wall_friction is None:
            raise InputError(
                f'kinematic_viscosity is given, but the route "{c.route}" tells no velocity at '
                'the wall; write a damping_ratio instead'
            )
        source = 'laminar boundary layers at the smooth wall (Keulegan 1959), mode by mode'
        found = Damping(c.wall_damping_ratio(viscosity), source)
    else:
        fit = FITS[formula]
        if tank.shape != fit.shape:
            raise InputError(
                f'damping_formula is {formula}, which is of a {fit.shape}, not of a {tank.shape}'
            )
        radius = tank.radius if isinstance(tank, UprightCylinder) else tank.height / 2.0
        first = fit.ratio(radius, c.liquid.depth, viscosity)
        if c.wall_friction is None:
            found = Damping(np.full(c.omega.shape, first), f'{fit.source}; all modes as the first')
        else:
            theory = c.wall_damping_ratio(viscosity)
            found = Damping(
                first * theory / theory[np.argmin(c.omega)],
                f'{fit.source}; higher modes in the proportion of their boundary layers',
            )
    if (worst := float(found.ratio.max())) > MAX_WALL_DAMPING:
        raise InputError(
            f'kinematic_viscosity is {viscosity:g} m^2/s, for which thin boundary layers would '
            f'damp by {worst:.2g}; write the damping_ratio of so thick a liquid yourself'
        )
    return found


def with_rings(
    tank: Tank, coefficients: ModalCoefficients, bare: Damping, baffles: RingBaffles
) -> Damping:
    """
    Add the damping of rings to that of the bare tank, in the lowest modes along and across.

    Rings that are dry, or that the wave lays bare, count nothing: Miles has no formula for them.

    Parameters
    ----------
    tank : Tank
        The tank, an upright cylinder.
    coefficients : ModalCoefficients
        Of the liquid in it.
    bare : Damping
        Of the tank without them.
    baffles : RingBaffles
        The rings.

    Raises
    ------
    InputError
        If the tank is none, or the rings do not fit into it.
    """
    if not isinstance(tank, UprightCylinder):
        raise InputError(f'baffle_width is given for a {tank.shape}; rings are of a cylinder_z')
    if not 0.0 < baffles.width < tank.radius:
        raise InputError(
            f'baffle_width is {baffles.width:g} m; in a cylinder of {tank.radius:g} m radius it '
            'must lie between 0 and that'
        )
    liquid = coefficients.liquid
    below = liquid.surface_height - np.array(baffles.heights)
    wet = below[(below >= baffles.wave) & (below < liquid.depth)]
    ring = ring_damping(tank.radius, baffles.width, wet, baffles.wave)
    lowest = np.isclose(coefficients.omega, coefficients.omega.min(initial=np.inf), rtol=1e-9)
    return Damping(
        bare.ratio + ring * lowest,
        f'{bare.source}; in the lowest modes +{ring:.3g} by {len(wet)} of {len(below)} ring '
        f'baffles, below a wave of {baffles.wave:g} m (Miles 1958, NASA SP-8031)',
    )


def _viscosity_root(radius: float, viscosity: float) -> float:
    """Square root of the inverse Reynolds number nu/sqrt(g R^3)."""
    return float(np.sqrt(viscosity / np.sqrt(GRAVITY * radius**3)))
