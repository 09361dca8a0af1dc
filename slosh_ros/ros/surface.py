"""The free surface and the tanks as markers for RViz and Foxglove."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from rclpy.node import Node
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine import SloshEngine
from slosh_ros.engine.model import TankModel
from slosh_ros.modal.picture import SurfaceMesh, colours, tank_lines
from slosh_ros.modal.validity import WAVE_LIMIT
from slosh_ros.ros.heard import HeardPublisher

_LINE = 0.01  # thickness, of the tank's height
_GREY = ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)


class SurfaceTopic:
    """
    `~/surface`, at a limited rate and only while somebody listens.

    Parameters
    ----------
    node : Node
        Whose topic it is.
    engine : SloshEngine
        Of the liquid.
    rate : float
        How often it is published, by the stamps of the samples [Hz].
    """

    def __init__(self, node: Node, engine: SloshEngine, rate: float) -> None:
        self._engine = engine
        self._period = round(NANOSECONDS / rate)
        self._slot: int | None = None
        self._publisher = HeardPublisher(node, MarkerArray, '~/surface', 1)
        self._pictures: list[_TankPicture] = []

    def publish(self, stamp: int) -> None:
        """Publish the surfaces if it is time to, under a stamp [ns]."""
        if not self._publisher.heard:
            return
        slot = stamp // self._period
        if slot == self._slot:
            return
        self._slot = slot
        tanks = self._engine.tanks
        if not self._pictures:
            single = len(tanks) == 1
            self._pictures = [
                _TankPicture(tank, 'tank_link' if single else f'{tank.config.name}_link')
                for tank in tanks
            ]
        message, seconds = MarkerArray(), Time()
        seconds.sec, seconds.nanosec = divmod(stamp, NANOSECONDS)
        for tank, picture in zip(tanks, self._pictures, strict=True):
            message.markers += picture.show(tank, seconds)
        self._publisher.publish(message)


class _TankPicture:
    """The markers of one tank; the surface is built anew when the fill changes."""

    def __init__(self, tank: TankModel, frame: str) -> None:
        header = Header(frame_id=frame)
        name = tank.config.name
        self._outline = Marker(
            header=header, ns=name, id=1, type=Marker.LINE_LIST, action=Marker.ADD, color=_GREY
        )
        self._outline.pose.orientation.w = 1.0
        self._outline.scale.x = _LINE * tank.config.tank.height
        self._outline.points = [
            Point(x=x, y=y, z=z)
            for x, y, z in tank_lines(tank.config.tank).reshape(-1, 3).tolist()
        ]
        self._surface = Marker(header=header, ns=name, id=0, type=Marker.TRIANGLE_LIST)
        self._surface.pose.orientation.w = 1.0
        scale = self._surface.scale
        scale.x = scale.y = scale.z = 1.0
        self._surface.color.a = 1.0
        self._coefficients: object = None

    def show(self, tank: TankModel, stamp: Time) -> list[Marker]:
        if tank.coefficients is not self._coefficients:
            self._take(tank)
        self._outline.header.stamp = stamp
        wave = self._mesh.elevation(tank.beta)
        heights = self._mesh.points[:, 2] + wave
        shades = colours(wave / self._full_colour) if len(wave) else wave.reshape(0, 3)
        for point, colour, z, rgb in zip(
            self._corners, self._colours, heights.tolist(), shades.tolist(), strict=True
        ):
            point.z = z
            colour.r, colour.g, colour.b = rgb
        return [self._surface, self._outline]

    def _take(self, tank: TankModel) -> None:
        """Build the triangles; they share their corners, so that only those need be moved."""
        liquid = tank.coefficients.liquid
        self._coefficients = tank.coefficients
        mesh = self._mesh = SurfaceMesh.of(tank.coefficients)
        # crest and trough have the full colour where linear theory ends
        self._full_colour = WAVE_LIMIT * min(liquid.depth, liquid.freeboard)
        self._corners = [Point(x=x, y=y) for x, y, _ in mesh.points.tolist()]
        self._colours = [ColorRGBA(a=1.0) for _ in self._corners]
        corners = mesh.triangles.ravel().tolist()
        self._surface.points = [self._corners[i] for i in corners]
        self._surface.colors = [self._colours[i] for i in corners]
        self._surface.action = Marker.ADD if corners else Marker.DELETE
