"""
Tanks at rest: shape, fill, centroid, frozen inertia.

A new shape of uniform section is one class in :mod:`slosh_ros.tank.section`; a new kind of tank
one class beside :class:`~slosh_ros.tank.uniform.UniformTank`.
"""

from slosh_ros.tank.section import Circle, Rectangle, Section, SectionMoments
from slosh_ros.tank.uniform import LiquidAtRest, UniformTank, cylinder_x, rectangular
from slosh_ros.tank.upright import UprightCylinder, cylinder_z

Tank = UniformTank | UprightCylinder

__all__ = [
    'Circle',
    'LiquidAtRest',
    'Rectangle',
    'Section',
    'SectionMoments',
    'Tank',
    'UniformTank',
    'UprightCylinder',
    'cylinder_x',
    'cylinder_z',
    'rectangular',
]
