"""
One tank by every route that applies, side by side.

Modes are compared by what is physical, whatever their scale: natural frequency, modal mass
lambda^2/mu and lever; surge with pitch, sway with roll, yaw. The first route is the tank's own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.fit import SURGE, SWAY, YAW, Family, added_mass_coefficients
from slosh_ros.hydro.frequency import total_added_mass
from slosh_ros.hydro.recipe import recipe_from_added_mass
from slosh_ros.hydro.routes import by_volume
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.hydro.volume import full_volume_coefficients, volume_coefficients
from slosh_ros.study.enclosed import Enclosed
from slosh_ros.tank import Capsule, KnownLiquid, Rectangle, Tank, UniformTank

SMALLEST = 5e-3  # of the heaviest mode of a family; below it a mode is left out
LOWEST = 2  # modes of each family that are compared
MODES = 40  # that a route is asked for, so that the lowest of every family are among them
FEW = 12  # that the 3-D route is asked for, which takes its time
MANY = 120  # that make an added mass: as good as all
POINTS = 60  # frequencies of an added mass
PAPER_GRID = np.append(0.05 + 0.1 * np.arange(50), 50.0)  # [rad/s]; the last for infinity
HALF = 1e-6  # from half full at which a tank counts for it
# kappa R of half-full vessels: circle (Evans & Linton 1993), sphere (m = 1, McIver 1989)
CIRCLE = (1.355727, 4.651054)
SPHERE = (1.560157, 5.275546)


class Quantity(NamedTuple):
    """A number that routes share."""

    name: str
    unit: str


@dataclass(frozen=True)
class Route:
    """
    What one route gives.

    Attributes
    ----------
    name : str
        Its name.
    values : dict
        Numbers by quantity.
    absent : str
        Why there are none; empty if there are.
    """

    name: str
    values: dict[Quantity, float] = field(default_factory=dict)
    absent: str = ''

    def differences(self, reference: Route) -> dict[Quantity, float]:
        """Relative differences from another route."""
        return {
            quantity: value / reference.values[quantity] - 1.0
            for quantity, value in self.values.items()
            if reference.values.get(quantity)
        }

    def as_json(self, reference: Route) -> dict[str, object]:
        """Return it for machines, with relative differences from another route."""
        off = self.differences(reference)
        return {
            'name': self.name,
            'absent': self.absent,
            'values': {
                quantity.name: {
                    'value': value,
                    'unit': quantity.unit,
                    'difference': off.get(quantity),
                }
                for quantity, value in self.values.items()
            },
        }

    def verdict(self, reference: Route) -> str:
        """Say in one line how far it is from another route at worst."""
        if self.absent:
            return f'{self.name}: {self.absent}'
        found = self.differences(reference)
        if not found:
            return f'{self.name}: nothing to compare with {reference.name}'
        worst = max(found, key=lambda quantity: abs(found[quantity]))
        return (
            f'{self.name}: differs from {reference.name} by {abs(found[worst]):.2g} at most '
            f'({worst.name}), of {len(found)} numbers'
        )


def compare(tank: Tank, depth: float, density: float) -> list[Route]:
    """
    Solve for one liquid by all routes that apply; the tank's own comes first.

    Parameters
    ----------
    tank : Tank
        The tank.
    depth : float
        Of the liquid [m].
    density : float
        Of the liquid [kg/m^3].

    Raises
    ------
    InputError
        If the liquid is known from added mass alone, or there is none, or its own route fails.
    """
    if isinstance(tank, KnownLiquid):
        raise InputError(
            'there is one route to a liquid that is known from its added mass; '
            'compare the tank by its shape'
        )
    if depth == 0.0:
        raise InputError('there is nothing to compare in an empty tank; choose another fill')
    own = coefficients_of(tank, depth, density, MODES)
    routes = [Route(own.route, values_of(own))]
    for name, solve in _others(tank, depth, density):
        try:
            routes.append(Route(name, solve()))
        except InputError as error:
            routes.append(Route(name, absent=str(error)))
    return routes


def values_of(c: ModalCoefficients) -> dict[Quantity, float]:
    """Collect what is physical: the lowest modes of each family, and the inertias under a lid."""
    values: dict[Quantity, float] = {}
    for family in (SURGE, SWAY, YAW):
        weight = c.coupling[:, family.push] ** 2 / c.mu
        heavy = weight > SMALLEST * weight.max(initial=0.0)
        for n, j in enumerate(np.flatnonzero(heavy)[:LOWEST], start=1):
            mode = f'{family.name} {n}'
            values[Quantity(f'omega {mode}', 'rad/s')] = float(c.omega[j])
            unit = 'kg m^2' if family is YAW else 'kg'
            values[Quantity(f'modal mass {mode}', unit)] = float(weight[j])
            if family is not YAW:
                arm = c.coupling[j, family.turn] / c.coupling[j, family.push]
                values[Quantity(f'lever {mode}', 'm')] = float(arm)
    for k, axis in enumerate(('roll', 'pitch', 'yaw')):
        inertia = float(c.inertia_stokes_joukowski[k, k])
        if inertia > 1e-9 * c.inertia_frozen[k, k]:
            values[Quantity(f'J0 {axis}', 'kg m^2')] = inertia
    return values


_Solve = Callable[[], dict[Quantity, float]]


def _others(tank: Tank, depth: float, density: float) -> Iterator[tuple[str, _Solve]]:
    if isinstance(tank, UniformTank) and isinstance(tank.section, Rectangle):
        yield (
            'section',
            lambda: values_of(section_coefficients(tank, depth, density, MODES)),
        )
    enclosed = tank if isinstance(tank, Capsule) and tank.is_sphere else Enclosed.of(tank)
    is_full = depth == tank.height
    if enclosed is not None and is_full:
        yield (
            'volume (3-D)',
            lambda: values_of(full_volume_coefficients(enclosed, depth, density)),
        )
    elif enclosed is not None:
        yield 'volume (3-D)', lambda: values_of(volume_coefficients(enclosed, depth, density, FEW))
    if is_full:
        return  # without waves there is no added mass to fit
    # by splines in 3-D fewer are enough for a fit
    many = coefficients_of(tank, depth, density, MODES if by_volume(tank) else MANY)
    yield 'added-mass fit', lambda: values_of(_fitted(many))
    yield "paper's recipe", lambda: _recipe(many)
    if abs(many.liquid.fill_ratio - 0.5) < HALF:
        if tank.shape == 'sphere':
            yield 'published', lambda: _published(SPHERE, tank.height / 2.0, (SURGE, SWAY))
        if tank.shape == 'cylinder_x' and isinstance(tank, UniformTank):
            yield 'published', lambda: _published(CIRCLE, tank.height / 2.0, (SWAY,))


def _added_mass(many: ModalCoefficients, omega: np.ndarray) -> AddedMass:
    return AddedMass(
        omega, total_added_mass(many, omega), many.density, np.zeros(3), source='added mass'
    )


def _fitted(many: ModalCoefficients) -> ModalCoefficients:
    """Fit the added mass that these modes make, up to a little above those that are compared."""
    values = values_of(many)
    top = max(v for q, v in values.items() if q.name.startswith('omega'))
    omega = 1.1 * top / POINTS * np.arange(1, POINTS + 1)
    # a frequency that meets a mode is moved a little: nobody solves there
    near = np.abs(omega[:, np.newaxis] - many.omega).min(axis=1) < 1e-6 * top
    omega[near] *= 1.0 + 1e-4
    return added_mass_coefficients(_added_mass(many, omega), many.liquid, MODES)


def _recipe(many: ModalCoefficients) -> dict[Quantity, float]:
    """Apply section 4.1 of the paper to the first mode along and across, on its grid."""
    data = _added_mass(many, PAPER_GRID)
    values: dict[Quantity, float] = {}
    for family, span in zip(
        (SURGE, SWAY), np.ptp(many.surface_points, axis=0).tolist(), strict=True
    ):
        mode = recipe_from_added_mass(data, many.liquid, span, family)
        name = f'{family.name} 1'
        values[Quantity(f'omega {name}', 'rad/s')] = mode.omega
        values[Quantity(f'modal mass {name}', 'kg')] = mode.push**2 / mode.mu
        values[Quantity(f'lever {name}', 'm')] = mode.turn / mode.push
    return values


def _published(
    kappas: tuple[float, ...], radius: float, families: tuple[Family, ...]
) -> dict[Quantity, float]:
    return {
        Quantity(f'omega {family.name} {n}', 'rad/s'): float(np.sqrt(GRAVITY * kappa / radius))
        for family in families
        for n, kappa in enumerate(kappas, start=1)
    }
