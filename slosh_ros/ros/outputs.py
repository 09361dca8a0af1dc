"""What slosh_node publishes of each sample; what nobody listens to costs next to nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure, JointState

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine import Loads, SloshEngine
from slosh_ros.engine.stamped import StampedDoubles
from slosh_ros.parameters import Values
from slosh_ros.ros.heard import HeardPublisher
from slosh_ros.ros.surface import SurfaceTopic

_DEPTH = 10

_Telling = Callable[[Loads], list[float]]  # what a message says; empty: there is nothing to say


class _Output(NamedTuple):
    publisher: HeardPublisher
    writer: StampedDoubles
    tell: _Telling


class Outputs:
    """
    The topics that follow the samples.

    A wrench that nobody has subscribed to is not published: DDS would not send it either, and a
    later subscriber would not get it.

    Parameters
    ----------
    node : Node
        Whose topics they are.
    engine : SloshEngine
        Of the loads.
    values : Values
        The parameters; `outputs.*` switch topics off.
    """

    def __init__(self, node: Node, engine: SloshEngine, values: Values) -> None:
        self._node = node
        self._engine = engine
        self._outputs: list[_Output] = []
        names, frame = [tank.config.name for tank in engine.tanks], engine.config.output_frame
        wrenches: dict[str, _Telling] = {
            'wrench': _wrench,
            'wrench_total': _total,
            'wrench_state': _state,
        }
        for name, tell in wrenches.items():
            if values.flag(f'outputs.{name}'):
                self._offer(WrenchStamped, name, StampedDoubles(frame, 6), tell)
        if values.flag('outputs.tank_wrenches') and len(names) > 1:
            for place, name in enumerate(names):
                tell = self._share_of(place)
                self._offer(WrenchStamped, f'{name}/wrench', StampedDoubles(frame, 6), tell)
        if values.flag('outputs.pressure'):
            for place, (point, of_tank) in enumerate(engine.config.pressure_points.items()):
                writer = StampedDoubles(of_tank, 2)
                self._offer(FluidPressure, f'pressure/{point}', writer, _pressure_at(place))
        if values.flag('outputs.centre_of_mass'):
            writer = StampedDoubles(frame, 3)
            self._offer(PointStamped, 'centre_of_mass', writer, self._centre)
        self._modes: HeardPublisher | None = None
        if values.flag('outputs.modes'):
            self._modes = HeardPublisher(node, JointState, '~/modes', _DEPTH)
        self._surface: SurfaceTopic | None = None
        if values.flag('outputs.surface'):
            self._surface = SurfaceTopic(node, engine, values.number('outputs.surface_rate'))

    def publish(self, loads: Loads) -> None:
        """Publish what is listened to, under the sample's stamp."""
        for publisher, writer, tell in self._outputs:
            if publisher.heard and (values := tell(loads)):
                publisher.publish(writer.write(loads.stamp, values))
        if self._modes is not None and self._modes.heard:
            self._modes.publish(self._joints(loads.stamp))
        if self._surface is not None:
            self._surface.publish(loads.stamp)

    def _offer(self, kind: type, topic: str, writer: StampedDoubles, tell: _Telling) -> None:
        publisher = HeardPublisher(self._node, kind, f'~/{topic}', _DEPTH)
        self._outputs.append(_Output(publisher, writer, tell))

    def _share_of(self, place: int) -> _Telling:
        return lambda _: self._engine.tanks[place].wrench.tolist()

    def _centre(self, _: Loads) -> list[float]:
        centre: list[float] = self._engine.centre_of_mass.tolist()
        return centre if centre[0] == centre[0] else []  # without liquid there is none

    def _joints(self, stamp: int) -> JointState:
        """Modes as joints, named by their tank where there are several."""
        tanks, message = self._engine.tanks, JointState()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
        for tank in tanks:
            prefix = f'{tank.config.name}/' if len(tanks) > 1 else ''
            message.name += [prefix + name for name in tank.coefficients.names]
            message.position.extend(tank.beta.tolist())
            message.velocity.extend(tank.beta_rate.tolist())
        return message


def _wrench(loads: Loads) -> list[float]:
    return loads.wrench.tolist()


def _total(loads: Loads) -> list[float]:
    return loads.total.tolist()


def _state(loads: Loads) -> list[float]:
    return loads.state.tolist()


def _pressure_at(place: int) -> _Telling:
    return lambda loads: [float(loads.pressure[place]), 0.0]  # the variance is not known
