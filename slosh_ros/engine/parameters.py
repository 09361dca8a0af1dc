"""
The one table of parameters of the sloshing engine: node, offline tools and documentation read it.

A new parameter is one row here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

from slosh_ros.engine.shapes import SHAPES
from slosh_ros.errors import InputError
from slosh_ros.hydro.damping import FORMULAS
from slosh_ros.parameters import Parameter, Values
from slosh_ros.parameters import resolved as resolved_with
from slosh_ros.tank.sizes import LARGEST, SMALLEST

TANK = '{tank}'  # stands for the name of each tank in the name of a row
POINT = '{point}'  # stands for any name that a user gives

POSITIVE = 1e-6  # [m] smallest dimension that is taken for one
FAR = 1e3  # [m] largest distance on a vehicle
TURN = 6.2832  # [rad] more than a turn is taken for degrees
_NAME = re.compile(r'[A-Za-z]\w*', re.ASCII)  # of a tank or point, and in those of topics
_POINT_MEANING = (
    'point of the tank or its wall whose pressure is published, in the tank frame; 0 while it is '
    'above the mean free surface; up to 1 mm outside is taken for rounding'
)

_OUTPUTS = {
    'wrench': '~/wrench',
    'wrench_total': '~/wrench_total',
    'wrench_state': '~/wrench_state',
    'tank_wrenches': '~/<tank>/wrench, where there are several tanks,',
    'modes': '~/modes',
    'centre_of_mass': '~/centre_of_mass',
    'surface': '~/surface',
    'pressure': '~/pressure/<point>',
}

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        'input.source', 'string', 'imu',
        'what drives the liquid: sensor_msgs/Imu on imu/data, or a twist of base_link on twist',
        choices=('imu', 'twist'),
    ),
    Parameter(
        'input.imu_frame', 'string', '',
        'frame_id that the Imu messages must carry; empty: any',
    ),
    Parameter(
        'input.twist_stamped', 'bool', True,
        'twist is a geometry_msgs/TwistStamped; false: a Twist, stamped with its time of arrival',
    ),
    Parameter(
        'imu.xyz', 'double[3]', [0.0, 0.0, 0.0], 'position of the IMU in base_link', 'm',
        -FAR, FAR,
    ),
    Parameter(
        'imu.rpy', 'double[3]', [0.0, 0.0, 0.0],
        'orientation of the IMU in base_link: roll, pitch, yaw about fixed axes (URDF)', 'rad',
        -TURN, TURN,
    ),
    Parameter(
        'imu.from_tf', 'bool', False,
        'whether slosh_node takes the pose of the IMU from TF instead, once; replay knows no TF',
    ),
    Parameter(
        'imu.bias.specific_force', 'double[3]', [0.0, 0.0, 0.0],
        'what the accelerometer reads too much, in its own axes; subtracted', 'm/s^2', -5.0, 5.0,
    ),
    Parameter(
        'imu.bias.angular_rate', 'double[3]', [0.0, 0.0, 0.0],
        'what the gyro reads too much, in its own axes; subtracted', 'rad/s', -1.0, 1.0,
    ),
    Parameter(
        'calibration.duration', 'double', 10.0,
        'how long ~/calibrate collects samples of a vehicle at rest', 's', 5.0, 600.0,
    ),
    Parameter(
        'calibration.finds', 'string', 'bias',
        'what explains a horizontal specific force at rest: a bias of the accelerometer, or the '
        'tilt of its mount (imu.rpy)',
        choices=('bias', 'mount'),
    ),
    Parameter(
        'calibration.file', 'string', 'slosh_calibration.yaml',
        'parameter file that ~/calibrate writes',
    ),
    Parameter(
        'imu.high_pass', 'double', 0.0,
        'corner frequency of a slow high-pass on horizontal specific force and rates, against a '
        'mount that leans or drifts; braking and turns longer than a sixth of its inverse fade; '
        '0: none', 'Hz', 0.0, 1.0,
    ),
    Parameter('tanks', 'string[]', ['tank'], 'names of the tanks'),
    Parameter(
        '{tank}.xyz', 'double[3]', [0.0, 0.0, 0.0],
        'position in base_link of the tank frame, the centre of the inner bounding box', 'm',
        -FAR, FAR,
    ),
    Parameter(
        '{tank}.rpy', 'double[3]', [0.0, 0.0, 0.0],
        'orientation of the tank frame in base_link: roll, pitch, yaw about fixed axes', 'rad',
        -TURN, TURN,
    ),
    Parameter(
        '{tank}.shape', 'string', None, 'shape of the tank; needed',
        choices=tuple(SHAPES),
    ),
    Parameter(
        '{tank}.length', 'double', None,
        'inner length along x; of the straight part, if a cylinder_x has heads',
        'm', POSITIVE, LARGEST,
    ),
    Parameter(
        '{tank}.width', 'double', None,
        'inner width along y (rectangular, ellipse_x, rounded_rectangle_x)', 'm', SMALLEST, LARGEST
    ),
    Parameter(
        '{tank}.height', 'double', None,
        'inner height along z (rectangular, cylinder_z, ellipse_x, rounded_rectangle_x)', 'm',
        SMALLEST, LARGEST
    ),
    Parameter(
        '{tank}.radius', 'double', None,
        'inner radius (cylinder_x, cylinder_z, sphere)', 'm', SMALLEST / 2.0, LARGEST / 2.0
    ),
    Parameter(
        '{tank}.head_depth', 'double', None,
        'inner depth of the ellipsoidal head at each end: radius for half a sphere, 0 or absent '
        'for flat ends (cylinder_x)', 'm', 0.0, LARGEST / 2.0
    ),
    Parameter(
        '{tank}.corner_radius', 'double', None,
        'radius of the four rounded edges (rounded_rectangle_x)', 'm', 0.0, LARGEST / 2.0
    ),
    Parameter(
        '{tank}.points', 'double[]', None,
        'corners y1, z1, y2, z2, ... of the inner section in order, either way round; '
        'the tank frame is at the centre of their bounding box, whatever their origin '
        '(section_x)', 'm', -FAR, FAR
    ),
    Parameter(
        '{tank}.mesh_file', 'file', None,
        "the tank's inner surface as closed triangles, STL, OBJ or PLY, x forward, y left, z up; "
        'the tank frame is at the centre of its bounding box, whatever its origin; a path that is '
        'not absolute starts from the folder of the parameter file (mesh)',
    ),
    Parameter(
        '{tank}.mesh_scale', 'double', None,
        'length of the unit of mesh_file, 0.001 for millimetres; 1.0 if absent (mesh)', 'm',
        1e-6, 1e6
    ),
    Parameter(
        '{tank}.added_mass_file', 'file', None,
        'added mass over frequency of the liquid, at one fill: .1 (WAMIT), .nc (Capytaine), .h5 '
        '(BEMIO), relative to the folder of the parameter file (added_mass)',
    ),
    Parameter(
        '{tank}.added_mass_reference', 'double[3]', None,
        'point of the moments and rotations in the axes of the file, x forward, y left, z up; '
        'needed for .1 (XBODY), held against the others (added_mass)', 'm', -FAR, FAR,
    ),
    Parameter(
        '{tank}.added_mass_surface_centre', 'double[3]', None,
        'centre of the mean free surface in the axes of the file; their origin by default '
        '(added_mass)', 'm', -FAR, FAR,
    ),
    Parameter(
        '{tank}.added_mass_length_scale', 'double', None,
        'length ULEN that made a .1 dimensionless (added_mass)', 'm', POSITIVE, 1e6,
    ),
    Parameter(
        '{tank}.added_mass_first_column', 'string', None,
        'first column of a .1: period [s], the default, or frequency [rad/s] (added_mass)',
        choices=('period', 'frequency'),
    ),
    Parameter(
        '{tank}.added_mass_hydrostatic', 'bool', None,
        'the entries 44 and 55 hold the hydrostatic moment of the surface, as the radiation '
        'potential gives it (the default); false: the code has it in its stiffness matrix '
        '(added_mass)',
    ),
    Parameter(
        '{tank}.liquid_mass', 'double', None,
        'mass of the liquid; held against the added mass at rest (added_mass)', 'kg', 1e-6, 1e9,
    ),
    Parameter(
        '{tank}.liquid_depth', 'double', None, 'greatest depth of the liquid (added_mass)', 'm',
        POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.liquid_centroid', 'double[3]', None,
        'centroid of the liquid in the tank frame (added_mass)', 'm', -FAR, FAR,
    ),
    Parameter(
        '{tank}.liquid_inertia', 'double[3]', None,
        'inertia of the frozen liquid about its centroid: roll, pitch, yaw (added_mass)',
        'kg m^2', 0.0, 1e12,
    ),
    Parameter(
        '{tank}.surface_centre', 'double[3]', None,
        'centre of the mean free surface in the tank frame (added_mass)', 'm', -FAR, FAR,
    ),
    Parameter(
        '{tank}.surface_length', 'double', None,
        'extent of the mean free surface along x (added_mass)', 'm', POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.surface_width', 'double', None,
        'extent of the mean free surface along y (added_mass)', 'm', POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.surface_moments', 'double[]', None,
        'integrals of x^2 and of y^2 over the mean free surface; those of a rectangle by default '
        '(added_mass)', 'm^4', 0.0, 1e12,
    ),
    Parameter(
        '{tank}.freeboard', 'double', None,
        'height of the roof above the mean free surface (added_mass)', 'm', POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.tank_volume', 'double', None, 'volume of the whole tank (added_mass)', 'm^3',
        1e-9, 1e9,
    ),
    Parameter(
        '{tank}.fill_ratio', 'double', None,
        'fraction of the volume that is filled; either this or fill_depth', '', 0.0, 1.0,
        live=True,
    ),
    Parameter(
        '{tank}.fill_depth', 'double', None,
        'greatest depth of the liquid; either this or fill_ratio', 'm', 0.0, 1e3,
    ),
    Parameter(
        '{tank}.modes', 'int', 8, 'number of sloshing modes, from the lowest frequency', '', 1, 128
    ),
    Parameter(
        '{tank}.damping_ratio', 'double | double[]', None,
        'damping ratio of every mode, or one a mode; without it, that of damping_formula '
        'if kinematic_viscosity is given, else none (an ideal liquid)', '', 0.0, 0.99,
    ),
    Parameter(
        '{tank}.damping_formula', 'string', 'automatic',
        'where the damping comes from if kinematic_viscosity is given: measured in smooth upright '
        'cylinders (stephens, mikishev_dorozhkin) or spheres (stofan_sumner), or laminar boundary '
        'layers; automatic takes stephens, stofan_sumner, boundary layers by shape',
        choices=FORMULAS,
    ),
    Parameter(
        '{tank}.baffle_width', 'double', None,
        'width of ring baffles in an upright cylinder, whose damping is added to that of the '
        'wall; with baffle_heights and baffle_wave', 'm', POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.baffle_heights', 'double[]', None, 'z of the ring baffles in the tank frame', 'm',
        -FAR, FAR,
    ),
    Parameter(
        '{tank}.baffle_wave', 'double', None,
        'height of the wave at the wall for which the damping of the baffles is taken', 'm',
        POSITIVE, 1e3,
    ),
    Parameter(
        '{tank}.kinematic_viscosity', 'double', None,
        'kinematic viscosity of the liquid, for the damping of a smooth bare tank', 'm^2/s',
        0.0, 1.0,
    ),
    Parameter('{tank}.density', 'double', 1000.0, 'density of the liquid', 'kg/m^3', 1e-3, 3e4),
    Parameter('pressure.{point}', 'double[3]', None, _POINT_MEANING, 'm', -FAR, FAR),
    Parameter(
        '{tank}.pressure.{point}', 'double[3]', None,
        _POINT_MEANING + '; of this tank where there are several', 'm', -FAR, FAR,
    ),
    Parameter(
        'frames.output', 'string', 'base_link',
        'frame of the wrenches: base_link, or tank_link of a single tank',
        choices=('base_link', 'tank_link'),
    ),
    Parameter(
        'model.gravity', 'string', 'constant',
        'what pulls the wave back: g, or the vertical specific force that the IMU measures, so '
        'that heave and slopes act on it; twist: g',
        choices=('constant', 'measured'),
    ),
    Parameter(
        'loads.cutoff', 'double', 0.0,
        'corner frequency of the low-pass on the measured acceleration on its way into the loads; '
        'the motion of the liquid follows the raw samples; 0: none', 'Hz', 0.0, 1e4,
    ),
    Parameter(
        'gate.max_gap', 'double', 0.5,
        'longest interval between samples over which the motion is interpolated; '
        'over a longer one the liquid moves freely', 's', 1e-3, 60.0,
    ),
    Parameter(
        'gate.reset_gap', 'double', 10.0,
        'interval between samples beyond which the liquid starts from rest', 's', 1e-3, 3600.0,
    ),
    Parameter(
        'gate.backward_jump', 'double', 1.0,
        'a stamp older than the last by more than this restarts from rest; by less, it is late',
        's', 0.0, 3600.0,
    ),
    Parameter(
        'gate.max_specific_force', 'double', 200.0,
        'largest specific force per axis that is believed', 'm/s^2', 1.0, 1e4,
    ),
    Parameter(
        'gate.max_angular_rate', 'double', 40.0,
        'largest angular rate per axis that is believed', 'rad/s', 0.1, 1e3,
    ),
    Parameter(
        'gate.max_speed', 'double', 150.0, 'largest speed per axis that is believed', 'm/s',
        1.0, 1e3,
    ),
    *(
        Parameter(f'outputs.{name}', 'bool', True, f'whether slosh_node offers {topic}')
        for name, topic in _OUTPUTS.items()
    ),
    Parameter(
        'outputs.surface_rate', 'double', 10.0,
        'how often ~/surface is published, by the stamps of the samples', 'Hz', 0.1, 100.0,
    ),
)  # fmt: skip


def rows_for(tanks: Iterable[str], given: Iterable[str] = ()) -> dict[str, Parameter]:
    """
    Return all rows by name.

    Parameters
    ----------
    tanks : iterable of str
        Names of the tanks; the rows of a tank come once for each.
    given : iterable of str
        Names of parameters; the rows of a point come once for each that fits, beside their own.

    Raises
    ------
    InputError
        If the name of a point is none for a topic.
    """
    rows = {row.name: row for row in PARAMETERS if TANK not in row.name}
    for tank in tanks:
        for row in PARAMETERS:
            if TANK in row.name:
                name = row.name.replace(TANK, tank)
                rows[name] = replace(row, name=name)
    for row in [row for row in rows.values() if POINT in row.name]:
        group = row.name.removesuffix(POINT)
        for name in given:
            point = name.removeprefix(group)
            if point == name:
                continue
            if not _NAME.fullmatch(point):
                raise InputError(
                    f"{name} gives a point the name '{point}'; a name has letters, digits and "
                    'underscores and begins with a letter'
                )
            rows[name] = replace(row, name=name)
    return rows


def resolved(given: Mapping[str, object]) -> tuple[dict[str, Parameter], Values]:
    """
    Check values against the table and fill in the defaults.

    Parameters
    ----------
    given : mapping
        Values by dotted name.

    Returns
    -------
    rows : dict
        The rows by name, with those of every tank.
    values : Values
        Every parameter that is given or has a default.

    Raises
    ------
    InputError
        On an unknown name, or a value that does not fit its row.
    """
    tanks = resolved_with(rows_for(()), {k: v for k, v in given.items() if k == 'tanks'})
    names = tanks.strings('tanks')
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise InputError(f'tanks names {", ".join(sorted(repeated))} more than once')
    groups = {row.name.partition('.')[0] for row in PARAMETERS}
    for name in names:
        if not _NAME.fullmatch(name) or name in groups:
            raise InputError(
                f"tanks has the name '{name}'; a name has letters, digits and underscores, begins "
                f'with a letter and is none of {", ".join(sorted(groups - {TANK}))}'
            )
    rows = rows_for(names, given)
    return rows, resolved_with(rows, given)
