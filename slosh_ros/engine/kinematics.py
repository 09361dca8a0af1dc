"""Where things sit on the vehicle, and what one measured point means for another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """
    Pose of a child frame in a parent frame.

    Attributes
    ----------
    rotation : array, shape (3, 3)
        Takes vectors from child axes to parent axes.
    origin : array, shape (3,)
        Origin of the child in the parent [m].
    """

    rotation: Array
    origin: Array

    @classmethod
    def identity(cls) -> Pose:
        """Child and parent coincide."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_xyz_rpy(cls, xyz: Array, rpy: Array) -> Pose:
        """Build from a URDF origin: position [m]; roll, pitch, yaw about fixed axes [rad]."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
        rotation = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return cls(rotation, np.asarray(xyz, dtype=float))

    def seen_from(self, other: Pose) -> Pose:
        """Return this pose in the axes of another child of the same parent."""
        to_other = other.rotation.T
        return Pose(to_other @ self.rotation, to_other @ (self.origin - other.origin))

    def offset(self, step: Array) -> Pose:
        """Return a pose whose origin is moved by `step`, in child axes [m]."""
        return Pose(self.rotation, self.origin + self.rotation @ step)
