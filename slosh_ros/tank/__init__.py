"""
Tanks at rest: shape, fill, centroid, frozen inertia.

A new shape of uniform section is one class in :mod:`slosh_ros.tank.section`; a new kind of tank
one class beside :class:`~slosh_ros.tank.uniform.UniformTank`.
"""

from slosh_ros.tank.capsule import Capsule, cylinder_x, sphere
from slosh_ros.tank.known import KnownLiquid
from slosh_ros.tank.mesh import MeshTank, mesh
from slosh_ros.tank.polygon import Polygon
from slosh_ros.tank.section import (
    Circle,
    Ellipse,
    Rectangle,
    RoundedRectangle,
    Section,
    SectionMoments,
    SymmetricSection,
)
from slosh_ros.tank.surface import LiquidSurface
from slosh_ros.tank.uniform import (
    LiquidAtRest,
    UniformTank,
    ellipse_x,
    rectangular,
    rounded_rectangle_x,
    section_x,
)
from slosh_ros.tank.upright import UprightCylinder, cylinder_z

Tank = UniformTank | UprightCylinder | Capsule | MeshTank | KnownLiquid

__all__ = [
    'Capsule',
    'Circle',
    'Ellipse',
    'KnownLiquid',
    'LiquidAtRest',
    'LiquidSurface',
    'MeshTank',
    'Polygon',
    'Rectangle',
    'RoundedRectangle',
    'Section',
    'SectionMoments',
    'SymmetricSection',
    'Tank',
    'UniformTank',
    'UprightCylinder',
    'cylinder_x',
    'cylinder_z',
    'ellipse_x',
    'mesh',
    'rectangular',
    'rounded_rectangle_x',
    'section_x',
    'sphere',
]
