"""The fill of a running node: topics and parameters that change it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from threading import Thread

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64

from slosh_ros.engine import SloshEngine
from slosh_ros.engine.convert import fill_topics
from slosh_ros.errors import InputError
from slosh_ros.ros.news import INFO, WARNING, News

REFUSED = 'fill refused'
# Heard from reliable and best-effort sensors of the level alike
_SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
_AT_ONCE = 0.05  # [s] in which closed forms are ready
_COARSE = 1e-3  # error of the coefficients that somebody should know of
_LATER = 'the liquid at other fills is being computed; this one comes as soon as it is known'


class FillInput:
    """
    Takes fills from `~/fill`, `~/<tank>/fill` where there are several tanks, and the parameters.

    The first one may have to wait for seconds, in which the liquid at other fills is computed in
    a process of its own, on which a thread waits; the samples go on. The parameter
    `<tank>.fill_ratio`, where it was given, follows the topic.

    Parameters
    ----------
    node : Node
        Whose topics and parameters they are.
    engine : SloshEngine
        Of the liquid.
    news : News
        Is told what happens.
    refuse : callable
        Is told that a message was refused.

    Attributes
    ----------
    changed : bool
        Whether the next sample finds another liquid than when this was set to False.
    """

    def __init__(
        self, node: Node, engine: SloshEngine, news: News, refuse: Callable[[str], None]
    ) -> None:
        self._node = node
        self._engine = engine
        self._news = news
        self._refuse = refuse
        self._names = [tank.config.name for tank in engine.tanks]
        self._wanted: dict[str, float] = {}  # until the coefficients are there
        self._untold: set[str] = set()  # tanks whose parameter does not tell their fill
        self.changed = self._following = False
        self._preparation: Thread | None = None
        self._impossible = ''
        self._told = False  # how good the coefficients at other fills are
        for name, topic in fill_topics(engine).items():
            take = partial(self._on_fill, name)
            node.create_subscription(Float64, f'~/{topic}', take, _SENSOR)
        node.add_on_set_parameters_callback(self._on_parameters)

    def bring(self) -> None:
        """Bring about what has had to wait; call it before each sample."""
        if self._wanted:
            self._apply()

    def follow(self) -> None:
        """Let the parameters tell what the topics have set; call it now and then."""
        settled = self._untold - self._wanted.keys()
        self._untold -= settled
        values = [
            Parameter(f'{name}.fill_ratio', value=self._engine.fill_ratio(name))
            for name in settled
            if self._node.has_parameter(f'{name}.fill_ratio')
        ]
        if values:
            self._following = True
            self._node.set_parameters(values)
            self._following = False

    def _on_fill(self, name: str, message: Float64) -> None:
        try:
            self._ask({name: message.data})
        except InputError as error:
            self._say_no(error)
        else:
            self._untold.add(name)

    def _on_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        """All of them or none."""
        fills = {f'{name}.fill_ratio': name for name in self._names}
        if self._following:
            return SetParametersResult(successful=True)
        try:
            self._ask({fills[p.name]: p.value for p in parameters if p.name in fills})
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True, reason=_LATER if self._wanted else '')

    def _ask(self, ratios: dict[str, float]) -> None:
        for name, ratio in ratios.items():
            self._engine.checked_fill(name, ratio)
        if self._impossible:
            raise InputError(self._impossible)
        for name, ratio in ratios.items():
            self._untold.discard(name)
            self._wanted[name] = ratio
        if ratios and self._preparation is None:
            self._preparation = Thread(target=self._prepare, daemon=True)
            self._preparation.start()
            self._preparation.join(_AT_ONCE)
            if self._preparation.is_alive():
                self._news.tell('preparation', _LATER, INFO)
        self._apply()

    def _prepare(self) -> None:
        try:
            self._engine.prepare_fills()
        except InputError as error:
            self._impossible = str(error)

    def _apply(self) -> None:
        """Hand on what waits, once the liquid is known at every fill."""
        if self._preparation is None or self._preparation.is_alive():
            return
        if not self._told:
            self._tell_errors()
        wanted, self._wanted = self._wanted, {}
        for name, ratio in wanted.items():
            try:
                self._fill(name, ratio)
            except InputError as error:
                self._untold.add(name)  # a parameter that was set tells of another one
                self._say_no(error)

    def _tell_errors(self) -> None:
        self._told = True
        for name, (error, of_solutions) in self._engine.fill_errors().items():
            text = f'the liquid of {name} is interpolated over the fill to {error:.1g}'
            if of_solutions:
                text += f', between solutions good to {of_solutions:.1g}'
            level = INFO if error < _COARSE else WARNING
            self._news.tell(f'error of {name}', text, level)

    def _fill(self, name: str, ratio: float) -> None:
        if self._impossible:
            raise InputError(self._impossible)
        if ratio != self._engine.fill_ratio(name):
            self._engine.set_fill(name, ratio)
            self.changed = True
            self._news.tell(f'fill of {name}', f'{name} is filled to {ratio:.4g}', INFO)

    def _say_no(self, error: InputError) -> None:
        self._refuse(REFUSED)
        self._news.tell(REFUSED, str(error))
