"""Messages written by hand are those of rclpy, but for its padding, which is not initialised."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import FluidPressure

from slosh_ros.engine.stamped import StampedDoubles

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000


@pytest.mark.parametrize('frame', ['', 'a', 'base_link', 'tank_link', 'compartment_12_link', 'ä'])
@pytest.mark.parametrize('stamp', [1, 1_700_000_000 * SECOND + 999_999_999])
def test_written_by_hand_reads_as_the_message(frame, stamp):
    values = [1.5, -2.0, 3e300, 5e-324, -0.0, 7.25]
    wrench, point, pressure = WrenchStamped(), PointStamped(), FluidPressure()
    for message in (wrench, point, pressure):
        message.header.frame_id = frame
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
    force, torque = wrench.wrench.force, wrench.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = values
    point.point.x, point.point.y, point.point.z = values[:3]
    pressure.fluid_pressure, pressure.variance = values[:2]
    for message, count in ((wrench, 6), (point, 3), (pressure, 2)):
        written = StampedDoubles(frame, count).write(stamp, values[:count])
        assert deserialize_message(written, type(message)) == message
        assert len(written) == len(serialize_message(message))
        assert written[-8 * count :] == serialize_message(message)[-8 * count :]
