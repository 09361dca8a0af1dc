"""The truck's stability on topics, in the log and in /diagnostics."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle import SteppedTruck
from slosh_ros.vehicle.stability import WHEELS, StabilityWatch, Thresholds
from slosh_ros.vehicle.stepped import NANOSECOND

_QUIET = 1.0  # [s] of simulated time between two warnings
_RATIOS = ('vehicle', 'tractor', 'semitrailer', 'axle 1', 'axle 2', 'axle 3', 'axle 4')
_DEPTH = 10
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class StabilityTopics:
    """
    Publishes wheel loads and load transfer, and warns where the linear truck is no real one.

    Parameters
    ----------
    node : Node
        Whose topics they are.
    truck : SteppedTruck
        The truck.
    """

    def __init__(self, node: Node, truck: SteppedTruck) -> None:
        self._node = node
        self._truck = truck
        self._watch = StabilityWatch()
        self._watch.look(0.0, truck.wheel_loads(), truck.articulation)
        self._said: tuple[bool, tuple[str, ...]] = (False, ())
        self._said_at = -math.inf
        self._wheels = JointState(name=list(WHEELS))
        self._wheels.header.frame_id = 'base_link'
        size = len(_RATIOS)
        label = 'load transfer ratio: ' + ', '.join(_RATIOS)
        self._ratios = Float64MultiArray()
        self._ratios.layout.dim = [MultiArrayDimension(label=label, size=size, stride=size)]
        self._loads = node.create_publisher(JointState, '~/wheel_loads', _DEPTH)
        self._transfer = node.create_publisher(Float64MultiArray, '~/load_transfer', _DEPTH)
        self._ratio = node.create_publisher(Float64, '~/load_transfer_ratio', _DEPTH)
        self._limits = node.create_publisher(Float64MultiArray, '~/rollover_thresholds', LATCHED)
        self._thresholds: dict[str, float] = {}

    def know(self, thresholds: Thresholds) -> None:
        """Publish and log at which lateral accelerations the truck rolls over."""
        t = thresholds
        self._thresholds = {
            'rigid truck, solid cargo': t.rigid_frozen / GRAVITY,
            'rigid truck, liquid cargo': t.rigid_liquid / GRAVITY,
            'truck on its springs, solid cargo': t.frozen / GRAVITY,
            'truck on its springs, liquid cargo': t.liquid / GRAVITY,
            'first wheel lifts off, solid cargo': t.lift_off_frozen / GRAVITY,
            'first wheel lifts off, liquid cargo': t.lift_off_liquid / GRAVITY,
        }
        size = len(self._thresholds)
        message = Float64MultiArray(data=list(self._thresholds.values()))
        label = 'rollover threshold [g]: ' + '; '.join(self._thresholds)
        message.layout.dim = [MultiArrayDimension(label=label, size=size, stride=size)]
        self._limits.publish(message)
        self._node.get_logger().info(
            'in a steady turn the truck rolls over at '
            f'{t.liquid / GRAVITY:.3f} g with its liquid and at {t.frozen / GRAVITY:.3f} g with a '
            f'solid cargo (rigid truck: {t.rigid_liquid / GRAVITY:.3f} and '
            f'{t.rigid_frozen / GRAVITY:.3f} g)'
        )

    def publish(self, stamp: Time) -> None:
        """Publish the present under a stamp, and warn of what has changed."""
        loads = self._truck.wheel_loads()
        now = self._truck.time_ns * NANOSECOND
        transfer = self._watch.look(now, loads, self._truck.articulation)
        self._wheels.header.stamp = stamp
        self._wheels.effort = loads.ravel().tolist()
        self._loads.publish(self._wheels)
        units = [self._watch.ratio, float(transfer.tractor), float(transfer.semitrailer)]
        self._ratios.data = [*units, *transfer.axles.tolist()]
        self._transfer.publish(self._ratios)
        self._ratio.publish(Float64(data=self._watch.ratio))
        self._warn(now)

    def status(self) -> DiagnosticStatus:
        """Tell the state for /diagnostics."""
        watch = self._watch
        trouble = bool(watch.lifted) or watch.bent
        lowest = f'{watch.lowest_load:.0f} at wheel {watch.lowest_wheel}'
        values = {
            'load transfer ratio': f'{watch.ratio:.3f}',
            'largest load transfer ratio so far': f'{watch.load_transfer:.3f}',
            'lowest wheel load so far [N]': lowest,
            'wheels off the road': ' '.join(watch.lifted) or 'none',
            'first lift-off [s]': f'{watch.lift_off:.2f}',
            'articulation [rad]': f'{watch.articulation:.3f}',
        } | {f'rolls over at [g]: {name}': f'{g:.3f}' for name, g in self._thresholds.items()}
        return DiagnosticStatus(
            level=DiagnosticStatus.WARN if trouble else DiagnosticStatus.OK,
            name=f'{self._node.get_name()}: stability',
            message=self._words() or 'all wheels are on the road',
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )

    def summary(self) -> str:
        """Tell the figures of the drive."""
        watch = self._watch
        lifted = math.isfinite(watch.lift_off)
        return (
            f'largest load transfer ratio {watch.load_transfer:.3f} at '
            f't = {watch.load_transfer_at:.2f} s; lowest wheel load {watch.lowest_load:.0f} N at '
            f'wheel {watch.lowest_wheel}, t = {watch.lowest_at:.2f} s; '
            + (f'first lift-off at t = {watch.lift_off:.2f} s' if lifted else 'no lift-off')
        )

    def _warn(self, now: float) -> None:
        """Say once what has changed, not more often than once a second."""
        state = self._watch.bent, self._watch.lifted
        if state == self._said or now - self._said_at < _QUIET:
            return
        self._said, self._said_at = state, now
        words = self._words() or 'all wheels are on the road again, the truck is not bent'
        self._node.get_logger().warning(f't = {now:.2f} s: {words}')

    def _words(self) -> str:
        """Put what takes the truck out of its theory into words; empty if nothing does."""
        watch, words = self._watch, []
        if watch.lifted:
            words.append(
                f'lifted off: {", ".join(watch.lifted)}, lowest wheel load so far '
                f'{watch.lowest_load:.0f} N; the linear springs hold such wheels to the road, '
                'a real truck would lean further'
            )
        if watch.bent:
            words.append(f'articulation {watch.articulation:.2f} rad, too large for small angles')
        return '; '.join(words)
