"""What a simulator of the vehicle has to know of the liquid it carries, latched."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import InertiaStamped, PointStamped
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from slosh_ros.engine import SloshEngine

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Latched:
    """
    The topics of a liquid that stays as it is for long.

    Parameters
    ----------
    node : Node
        Whose topics they are.
    engine : SloshEngine
        Of the liquid.
    """

    def __init__(self, node: Node, engine: SloshEngine) -> None:
        self._engine = engine
        self._matrices = {
            name: node.create_publisher(Float64MultiArray, f'~/{name}', LATCHED)
            for name in ('coupling', 'coupling_exact', 'softening')
        }
        self._liquid = node.create_publisher(InertiaStamped, '~/liquid', LATCHED)
        self._centre = node.create_publisher(PointStamped, '~/surface_centre', LATCHED)

    def tell(self) -> None:
        """Publish the liquid as it is now."""
        engine, carried = self._engine, self._engine.carried
        frame = engine.config.output_frame
        wrench = f'wrench in {frame}: fx fy fz mx my mz'
        acceleration = f'acceleration of {frame}: sx sy sz ax ay az'
        exact = wrench.replace(':', ', the liquid turning with its Stokes-Joukowski inertia:')
        displacement = f'displacement of {frame}: x y z rx ry rz'
        for name, matrix, row, column in (
            ('coupling', carried.coupling, wrench, acceleration),
            ('coupling_exact', carried.coupling_exact, exact, acceleration),
            ('softening', engine.softening, wrench, displacement),
        ):
            self._matrices[name].publish(_labelled(matrix, row, column))
        liquid = InertiaStamped()
        liquid.header.frame_id = frame
        told, inertia = liquid.inertia, carried.inertia_at_centroid
        told.m = carried.mass
        told.com.x, told.com.y, told.com.z = carried.centroid.tolist()
        told.ixx, told.iyy, told.izz = np.diag(inertia).tolist()
        told.ixy, told.ixz, told.iyz = (float(inertia[k]) for k in ((0, 1), (0, 2), (1, 2)))
        self._liquid.publish(liquid)
        centre = PointStamped()
        centre.header.frame_id = frame
        centre.point.x, centre.point.y, centre.point.z = engine.surface_centre.tolist()
        self._centre.publish(centre)


def _labelled(matrix: NDArray[np.float64], row: str, column: str) -> Float64MultiArray:
    message = Float64MultiArray(data=matrix.ravel().tolist())
    message.layout.dim = [
        MultiArrayDimension(label=row, size=6, stride=36),
        MultiArrayDimension(label=column, size=6, stride=6),
    ]
    return message
