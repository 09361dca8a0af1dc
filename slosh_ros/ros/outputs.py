"""What slosh_node publishes of each sample; what nobody listens to costs next to nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Header

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine import Loads, SloshEngine
from slosh_ros.engine.model import TankModel
from slosh_ros.parameters import Values
from slosh_ros.ros.surface import SurfaceTopic

_DEPTH = 10


class _Output(NamedTuple):
    publisher: Publisher
    message: Any  # one for all samples, filled anew
    fill: Callable[[Any, Loads], bool]  # False: there is nothing to say


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
        self._stamp = Time()  # shared by all messages
        self._outputs: list[_Output] = []
        tanks, frame = engine.tanks, engine.config.output_frame
        for name, fill in (
            ('wrench', _fill_wrench),
            ('wrench_total', _fill_total),
            ('wrench_state', _fill_state),
        ):
            if values.flag(f'outputs.{name}'):
                self._offer(WrenchStamped, name, frame, fill)
        if values.flag('outputs.tank_wrenches') and len(tanks) > 1:
            for place, tank in enumerate(tanks):
                fill = partial(_fill_share, engine, place)
                self._offer(WrenchStamped, f'{tank.config.name}/wrench', frame, fill)
        if values.flag('outputs.pressure'):
            for place, (point, of_tank) in enumerate(engine.config.pressure_points.items()):
                fill = partial(_fill_pressure, place)
                self._offer(FluidPressure, f'pressure/{point}', of_tank, fill)
        if values.flag('outputs.modes'):
            self._offer(JointState, 'modes', '', partial(_fill_modes, engine))
        if values.flag('outputs.centre_of_mass'):
            self._offer(PointStamped, 'centre_of_mass', frame, partial(_fill_centre, engine))
        self._surface: SurfaceTopic | None = None
        if values.flag('outputs.surface'):
            self._surface = SurfaceTopic(node, engine, values.number('outputs.surface_rate'))

    def publish(self, loads: Loads) -> None:
        """Publish what is listened to, under the sample's stamp."""
        self._stamp.sec, self._stamp.nanosec = divmod(loads.stamp, NANOSECONDS)
        for publisher, message, fill in self._outputs:
            if publisher.get_subscription_count() and fill(message, loads):
                publisher.publish(message)
        if self._surface is not None:
            self._surface.publish(loads.stamp, self._stamp)

    def _offer(
        self, kind: type, topic: str, frame: str, fill: Callable[[Any, Loads], bool]
    ) -> None:
        publisher = self._node.create_publisher(kind, f'~/{topic}', _DEPTH)
        message = kind(header=Header(stamp=self._stamp, frame_id=frame))
        self._outputs.append(_Output(publisher, message, fill))


def _fill_wrench(message: WrenchStamped, loads: Loads) -> bool:
    return _six(message, loads.wrench)


def _fill_total(message: WrenchStamped, loads: Loads) -> bool:
    return _six(message, loads.total)


def _fill_state(message: WrenchStamped, loads: Loads) -> bool:
    return _six(message, loads.state)


def _fill_share(engine: SloshEngine, place: int, message: WrenchStamped, _: Loads) -> bool:
    return _six(message, engine.tanks[place].wrench)


def _six(message: WrenchStamped, wrench: Any) -> bool:
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = wrench.tolist()
    return True


def _fill_pressure(place: int, message: FluidPressure, loads: Loads) -> bool:
    message.fluid_pressure = float(loads.pressure[place])
    return True


def _fill_modes(engine: SloshEngine, message: JointState, _: Loads) -> bool:
    message.name = [name for tank in engine.tanks for name in _mode_names(tank, engine.tanks)]
    message.position = [beta for tank in engine.tanks for beta in tank.beta.tolist()]
    message.velocity = [rate for tank in engine.tanks for rate in tank.beta_rate.tolist()]
    return True


def _mode_names(tank: TankModel, tanks: Iterable[TankModel]) -> Iterable[str]:
    """Names of the modes, with their tank's where there are several."""
    several = sum(1 for _ in tanks) > 1
    prefix = f'{tank.config.name}/' if several else ''
    return (prefix + name for name in tank.coefficients.names)


def _fill_centre(engine: SloshEngine, message: PointStamped, _: Loads) -> bool:
    centre = engine.centre_of_mass.tolist()
    message.point.x, message.point.y, message.point.z = centre
    return centre[0] == centre[0]  # without liquid there is none
