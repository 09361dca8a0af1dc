"""The shapes of tanks that a configuration can name: one row each."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass_tank import added_mass_tank
from slosh_ros.parameters import Values
from slosh_ros.tank import (
    Tank,
    UniformTank,
    cylinder_x,
    cylinder_z,
    ellipse_x,
    mesh,
    rectangular,
    rounded_rectangle_x,
    section_x,
    sphere,
)
from slosh_ros.tank.sizes import LARGEST, SMALLEST


class Shape(NamedTuple):
    """
    How a shape is read.

    Attributes
    ----------
    build : callable
        Makes the tank of the parameters, by name.
    needs : tuple of str
        Parameters that must be given.
    takes : tuple of str
        Parameters that may be given.
    shares : tuple of str
        Parameters of every tank that the shape depends on.
    """

    build: Callable[..., Tank]
    needs: tuple[str, ...]
    takes: tuple[str, ...] = ()
    shares: tuple[str, ...] = ()


SHAPES: dict[str, Shape] = {
    'rectangular': Shape(rectangular, ('length', 'width', 'height')),
    'cylinder_x': Shape(cylinder_x, ('radius', 'length'), ('head_depth',)),
    'cylinder_z': Shape(cylinder_z, ('radius', 'height')),
    'ellipse_x': Shape(ellipse_x, ('width', 'height', 'length')),
    'rounded_rectangle_x': Shape(
        rounded_rectangle_x, ('width', 'height', 'corner_radius', 'length')
    ),
    'mesh': Shape(mesh, ('mesh_file',), ('mesh_scale',)),
    'section_x': Shape(section_x, ('points', 'length')),
    'sphere': Shape(sphere, ('radius',)),
    'added_mass': Shape(
        added_mass_tank,
        (
            'added_mass_file',
            'liquid_mass',
            'liquid_depth',
            'liquid_centroid',
            'liquid_inertia',
            'surface_centre',
            'surface_length',
            'surface_width',
            'freeboard',
            'tank_volume',
        ),
        (
            'surface_moments',
            'added_mass_reference',
            'added_mass_surface_centre',
            'added_mass_length_scale',
            'added_mass_first_column',
            'added_mass_hydrostatic',
        ),
        ('density',),
    ),
}


def tank_of(p: Values, name: str) -> Tank:
    """
    Build the tank of the given name.

    Raises
    ------
    InputError
        If its shape or one of its parameters is missing or does not fit, or one is given that
        does not belong.
    """
    if f'{name}.shape' not in p:
        raise InputError(f'{name}.shape is missing; write one of {", ".join(SHAPES)}')
    kind = p.string(f'{name}.shape')
    shape = SHAPES[kind]
    wanted = (*shape.needs, *shape.takes)
    for parameter in sorted({key for other in SHAPES.values() for key in other[1] + other[2]}):
        key = f'{name}.{parameter}'
        if parameter in shape.needs and key not in p:
            raise InputError(f'{key} is missing; a {kind} tank needs {", ".join(shape.needs)}')
        if parameter not in wanted and key in p:
            raise InputError(
                f'{key} is given, but a {kind} tank takes {", ".join(wanted)}; remove it'
            )
    wanted += shape.shares
    given = {k: p.by_name[f'{name}.{k}'] for k in wanted if f'{name}.{k}' in p}
    try:
        tank = shape.build(**given)
        _check_size(tank)
    except InputError as error:
        raise InputError(f'{name}.{error}') from error
    return tank


def _check_size(tank: Tank) -> None:
    """Refuse what no row of the table can tell: points in millimetres, a length in kilometres."""
    if not isinstance(tank, UniformTank):
        return
    width, height = tank.section.bounding_box
    for told, side in (
        ('length is {:g} m', tank.length),
        ('points span {:g} m in width', width),
        ('points span {:g} m in height', height),
    ):
        if not SMALLEST <= side <= LARGEST:
            raise InputError(
                f'{told.format(side)}; a tank has {SMALLEST:g} to {LARGEST:g} m: write metres'
            )
