"""
Damping ratios by published formulas, with the range in which each holds.

A smooth bare tank damps in the boundary layers of its walls. Where somebody has measured it, his
formula is the default: it holds what theory lacks (contact line, contaminated surface). Elsewhere
it is the dissipation of Stokes's layer, mode by mode, from the solved velocities at the wall.

* `stephens`, upright cylinders: Stephens, Leonard & Perry, NASA TN D-1367 (1962).
* `mikishev_dorozhkin`, upright cylinders: G. N. Mikishev & N. Ya. Dorozhkin (1961).
* `stofan_sumner`, spheres: viscosity by Sumner & Stofan, NASA TN D-1991 (1963), fill by Mikishev
  & Dorozhkin, joined in NASA SP-106.
* `boundary_layer`, all shapes whose route tells the velocity at the wall (Keulegan 1959,
  J. Fluid Mech. 6; Case & Parkinson 1957, J. Fluid Mech. 2): rectangular tanks, uniform sections,
  horizontal cylinders among them. For these no measured formula was found that could be confirmed.
* Ring baffles in upright cylinders: Miles (1958), J. Appl. Mech. 25, with the constants of NASA
  SP-8031 (1969); several rings add up (Bauer 1962, NASA TM X-50183).

Sources. No original was at hand. The constants of all measured formulas and of rings are those of
SLOSH-ML (Georgia Tech, github.com/LGST-LAB/slosh_ml, read), which takes them from NASA SP-106
(Abramson 1966, ch. 4), TN D-1367 and TM X-50183. Of Miles (1958) the abstract was read, of his
earlier report (Ramo-Wooldridge AM 6-5, 1956) the summary. Looked for in vain: the texts of SP-106,
SP-8009, SP-8031, TN D-1367, D-1991 and D-2969, Dodge (2000), Faltinsen & Timokha (2009, ch. 6),
SwRI on horizontal cylinders; a formula for longitudinal baffles or screens, so none is here.

Where they hold; what is derived here is held by tests.

* All: waves small, one clean liquid that does not turn, gravity large against surface tension.
* Laminar (derived): a wave eta at the wall moves liquid along it by eta/tanh(k h). Stokes's layer
  stays laminar up to a Reynolds number R = U sqrt(2/(nu omega)) of some hundreds: it is in
  transition from 254 to 1315 (Mier et al. 2021, J. Fluid Mech. 922), unstable throughout its
  period above 850 (Blondeaux & Vittori 2021); Miles (1956) has laminar friction in a 10 ft tank
  of water up to amplitudes of 10 in, R = 670. `LAMINAR` is taken; the wave is told in metres.
* Thin layers (derived): the layers hold four times the damping ratio of a mode's energy, a share
  that theory neglects. Above `THIN_WALL_DAMPING` a tenth: told; above `MAX_WALL_DAMPING`: refused.
* `stephens`: models of 12 and 36 in. in diameter. At all depths it is 1.49 times theory, within
  0.2 %, though fitted apart from it: so its law of depth and size is that of laminar layers, and
  the factor is what experiment adds.
* `mikishev_dorozhkin` (derived): from h = R/2 on it is 1.39 to 1.55 times theory. Below it sinks,
  and under h = R/4 beneath theory, than which no tank damps less. Size and viscosity: not found.
* `stofan_sumner` (derived): up to half full its law of fill is that of theory within 7 %. Above it
  departs, to tenfold near full; and as B^0.359, not B^0.5 as laminar layers do, it leaves
  theory behind as tanks grow: from 3 times theory in a sphere of 0.1 m to 8 times in one of 10 m.
  Beyond `MOST_OVER_THEORY` that is told. The range of B was not found.
* Rings (derived): Miles's exponents 4.60, 3/2 and 1/2 follow from the drag 15/sqrt(K) of a flat
  plate (Keulegan & Carpenter 1958) in the first mode of deep water; his constant, 8.0 (w/R)^1.5,
  lies between those for K by the width of the ring, 6.1, and with its image in the wall, 8.6. So
  it holds while K = 2 pi eta exp(-1.84 d/R)/w at the ring lies in the range of that drag, 2 to
  20 (as remembered, not read), and the liquid is deeper than the radius.

The measured formulas are of the lowest mode. Higher modes take its ratio times what the boundary
layers of theory make of theirs over that of the lowest; the same ratio where the route does not
tell. Rings act on the lowest modes alone: the depth at which they hang is deep for all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.tank import Tank, UprightCylinder

Array = NDArray[np.float64]

MAX_WALL_DAMPING = 0.1  # beyond it the boundary layers are not thin
THIN_WALL_DAMPING = 0.025  # beyond it they hold a tenth of the energy
LAMINAR = 500.0  # Reynolds number U sqrt(2/(nu omega)) up to which Stokes's layer is taken for it
MOST_OVER_THEORY = 5.0  # that a measured formula is believed
PLATE_PERIODS = (2.0, 20.0)  # Keulegan-Carpenter numbers of the drag behind Miles's formula
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
    holds : str
        The range in which that holds, for people; empty if there is none to tell.
    beyond : tuple of str
        What of it this liquid leaves, for people.
    """

    ratio: Array
    source: str
    holds: str = ''
    beyond: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Source and range in one line."""
        return f'{self.source} ({self.holds})' if self.holds else self.source


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


def laminar_wave(omega: float, depth: float, viscosity: float) -> float:
    """
    Height of the wave at the wall up to which the layers of a mode stay laminar [m].

    Parameters
    ----------
    omega : float
        Natural frequency of the mode [rad/s].
    depth : float
        Of the liquid [m].
    viscosity : float
        Kinematic [m^2/s].
    """
    deep = omega**2 * depth / GRAVITY
    wave_number = scipy.optimize.brentq(lambda kh: kh * np.tanh(kh) - deep, 0.0, deep + 1.0)
    return float(LAMINAR * np.sqrt(viscosity / (2.0 * omega)) * np.tanh(wave_number))


class _Fit(NamedTuple):
    source: str
    shape: str
    ratio: Callable[[float, float, float], float]
    holds: str
    radii: tuple[float, float] = (0.0, np.inf)  # [m]
    fills: tuple[float, float] = (0.0, np.inf)  # depth over radius


FITS = {
    'stephens': _Fit(
        'Stephens, Leonard & Perry (1962), NASA TN D-1367, smooth upright cylinder',
        'cylinder_z',
        stephens,
        'fitted in tanks of 0.15 to 0.46 m radius, at any depth',
        radii=(0.15, 0.46),
    ),
    'mikishev_dorozhkin': _Fit(
        'Mikishev & Dorozhkin (1961), NASA SP-106, smooth upright cylinder',
        'cylinder_z',
        mikishev_dorozhkin,
        'from a depth of half the radius on',
        fills=(0.5, np.inf),
    ),
    'stofan_sumner': _Fit(
        'Sumner & Stofan (1963), NASA TN D-1991, smooth sphere',
        'sphere',
        stofan_sumner,
        'up to half full, in tanks of the laboratory',
        fills=(0.0, 1.0),
    ),
}
FORMULAS = ('automatic', 'boundary_layer', *FITS)
_DEFAULT = {'cylinder_z': 'stephens', 'sphere': 'stofan_sumner'}


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
        Of the liquid in it, which has modes.
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
        found = Damping(
            c.wall_damping_ratio(viscosity),
            'laminar boundary layers at the smooth wall (Keulegan 1959), mode by mode',
            'the least that a clean tank has',
        )
    else:
        found = _measured(tank, c, viscosity, FITS[formula], formula)
    worst = float(found.ratio.max())
    if worst > MAX_WALL_DAMPING:
        raise InputError(
            f'kinematic_viscosity is {viscosity:g} m^2/s, for which thin boundary layers would '
            f'damp by {worst:.2g}; write the damping_ratio of so thick a liquid yourself'
        )
    beyond = found.beyond
    if worst > THIN_WALL_DAMPING:
        beyond += (
            f'boundary layers hold {4.0 * worst:.0%} of the energy of a mode, which is more than '
            'the tenth that is thin',
        )
    wave = laminar_wave(float(c.omega.min()), c.liquid.depth, viscosity)
    laminar = f'laminar while the wave of the lowest mode is below {wave:.2g} m at the wall'
    return found._replace(holds=f'{found.holds}; {laminar}', beyond=beyond)


def _measured(
    tank: Tank, c: ModalCoefficients, viscosity: float, fit: _Fit, formula: str
) -> Damping:
    if tank.shape != fit.shape:
        raise InputError(
            f'damping_formula is {formula}, which is of a {fit.shape}, not of a {tank.shape}'
        )
    radius = tank.radius if isinstance(tank, UprightCylinder) else tank.height / 2.0
    fill = c.liquid.depth / radius
    first = fit.ratio(radius, c.liquid.depth, viscosity)
    beyond: list[str] = []
    if not fit.radii[0] <= radius <= fit.radii[1]:
        beyond.append(
            f'a radius of {radius:.3g} m is outside of the {fit.radii[0]:g} to {fit.radii[1]:g} m '
            'of the experiments; the law of laminar layers carries it there'
        )
    if not fit.fills[0] <= fill <= fit.fills[1]:
        limit = fit.fills[0] if fill < fit.fills[0] else fit.fills[1]
        beyond.append(
            f'a depth of {fill:.3g} radii is beyond {limit:g}, where the formula leaves the law '
            'of laminar layers'
        )
    if c.wall_friction is None:
        source = f'{fit.source}; all modes as the first'
        return Damping(np.full(c.omega.shape, first), source, fit.holds, tuple(beyond))
    lowest = int(np.argmin(c.omega))
    theory = c.wall_damping_ratio(1.0)
    over = first / (theory[lowest] * np.sqrt(viscosity)) if viscosity > 0.0 else 1.0
    if not 1.0 <= over <= MOST_OVER_THEORY:
        beyond.append(
            f'it is {over:.2g} times the boundary layers of theory, and holds from 1 to '
            f'{MOST_OVER_THEORY:g}; damping_formula: boundary_layer takes those'
        )
    source = f'{fit.source}; higher modes in the proportion of their boundary layers'
    return Damping(first * theory / theory[lowest], source, fit.holds, tuple(beyond))


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
    is_wet = (below >= baffles.wave) & (below < liquid.depth)
    wet = below[is_wet]
    ring = ring_damping(tank.radius, baffles.width, wet, baffles.wave)
    beyond = list(bare.beyond)
    least, most = PLATE_PERIODS
    near = baffles.wave * np.exp(-FIRST_ROOT * wet / tank.radius)
    for height, periods in zip(
        np.array(baffles.heights)[is_wet], 2.0 * np.pi * near / baffles.width, strict=True
    ):
        if not least <= periods <= most:
            beyond.append(
                f'at the ring at z = {height:g} m a wave of {baffles.wave:g} m moves the liquid '
                f'by {periods / (2.0 * np.pi):.2g} of its width, outside of the '
                f'{least / (2.0 * np.pi):.2g} to {most / (2.0 * np.pi):.2g} of its drag'
            )
    if len(wet) and liquid.depth < tank.radius:
        beyond.append(
            f'a liquid {liquid.depth:.3g} m deep is shallower than the radius, and rings are '
            'reckoned in deep liquid'
        )
    lowest = np.isclose(coefficients.omega, coefficients.omega.min(initial=np.inf), rtol=1e-9)
    return bare._replace(
        ratio=bare.ratio + ring * lowest,
        source=f'{bare.source}; in the lowest modes +{ring:.3g} by {len(wet)} of {len(below)} '
        f'ring baffles, below a wave of {baffles.wave:g} m (Miles 1958, NASA SP-8031)',
        beyond=tuple(beyond),
    )


def _viscosity_root(radius: float, viscosity: float) -> float:
    """Square root of the inverse Reynolds number nu/sqrt(g R^3)."""
    return float(np.sqrt(viscosity / np.sqrt(GRAVITY * radius**3)))
