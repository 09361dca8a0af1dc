"""The fill of a running node: topics and parameters that change it."""

from __future__ import annotations

from collections import deque
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
from slosh_ros.ros.diagnostics import Watch
from slosh_ros.ros.news import INFO, WARNING, News

REFUSED = 'fill refused'
# Heard from reliable and best-effort sensors of the level alike
_SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
_AT_ONCE = 0.05  # [s] in which closed forms are ready
_FROM_DISK = 3.0  # [s] in which a table is there that was built before
_COARSE = 1e-3  # error of the coefficients that somebody should know of
_LATER = (
    'the liquid at other fills is being computed; this one comes as soon as it is known, before '
    'all others'
)
_ONE_BY_ONE = 'fills cannot be tabulated, each is solved for by itself as it comes: '


class FillInput:
    """
    Takes fills from `~/fill`, `~/<tank>/fill` where there are several tanks, and the parameters.

    The first one may have to wait for seconds. Meanwhile the samples go on: threads wait for
    processes of their own, one that computes the liquid at all fills, and one that solves for the
    fill that is wanted, as long as that takes. The parameter `<tank>.fill_ratio`, where it was
    given, follows the topic.

    Parameters
    ----------
    node : Node
        Whose topics and parameters they are.
    engine : SloshEngine
        Of the liquid.
    news : News
        Is told what happens.
    watch : Watch
        Is told that a message was refused, and what fill is waited for.

    Attributes
    ----------
    changed : bool
        Whether the next sample finds another liquid than when this was set to False.
    """

    def __init__(self, node: Node, engine: SloshEngine, news: News, watch: Watch) -> None:
        self._node = node
        self._engine = engine
        self._news = news
        self._watch = watch
        self._names = [tank.config.name for tank in engine.tanks]
        self._wanted: dict[str, float] = {}  # until the coefficients are there
        self._untold: set[str] = set()  # tanks whose parameter does not tell their fill
        self.changed = self._following = self._busy = False
        self._preparation: Thread | None = None
        self._impossible = ''  # why not all fills can be known
        self._told = False  # how good the coefficients at other fills are
        self._solver: Thread | None = None
        self._solved: deque[tuple[str, float, str]] = deque()  # by the solver, or why not
        self._failed: dict[str, tuple[float, str]] = {}  # why it could not
        for name, topic in fill_topics(engine).items():
            take = partial(self._on_fill, name)
            node.create_subscription(Float64, f'~/{topic}', take, _SENSOR)
        node.add_on_set_parameters_callback(self._on_parameters)

    def bring(self) -> None:
        """Bring about what has had to wait; call it before each sample, and now and then."""
        if self._busy:
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

    def _solve(self, preparation: Thread, wanted: dict[str, float], wait: float) -> None:
        """Solve for some fills, one by one, unless all are known after a time [s]."""
        preparation.join(wait)
        for name, ratio in wanted.items():
            if not (preparation.is_alive() or self._impossible):
                return
            why = ''
            try:
                self._engine.solve_fill(name, ratio)
            except InputError as error:
                why = str(error)
            self._solved.append((name, ratio, why))

    def _apply(self) -> None:
        """Hand on what waits, as far as the liquid is known there."""
        if self._preparation is None:
            return
        over = not self._preparation.is_alive()
        solving = self._solver is not None and self._solver.is_alive()
        self._take_solved()
        if over and not self._told:
            self._tell_errors()
            self._failed.clear()  # where there is no table, more is solved for alone
            for name in self._names:  # as it is tabulated
                self._set(name, self._engine.fill_ratio(name))
        for name, ratio in list(self._wanted.items()):
            failed_at, why = self._failed.get(name, (None, ''))
            if ratio == self._engine.fill_ratio(name) or self._engine.fill_known(name, ratio):
                del self._wanted[name]
                self._set(name, ratio)
            elif over and failed_at == ratio:
                del self._wanted[name]
                self._untold.add(name)  # a parameter that was set tells of another one
                self._say_no(InputError(why))
        if not solving:
            solving = self._start_solver(self._preparation)
        self._busy = bool(self._wanted) or not over or solving
        for name in self._names:
            key = f'{name}.fill_ratio wanted'
            self._watch.extra.pop(key, None)
            if name in self._wanted:
                self._watch.extra[key] = f'{self._wanted[name]:.4f}, is being computed'

    def _start_solver(self, preparation: Thread) -> bool:
        """Let what is wanted be solved for, if that was not tried; tell whether it is."""
        wanted = {
            name: ratio
            for name, ratio in self._wanted.items()
            if self._failed.get(name, (None, ''))[0] != ratio
        }
        if wanted:
            wait = _FROM_DISK if self._solver is None else 0.0
            self._solver = Thread(
                target=self._solve, args=(preparation, wanted, wait), daemon=True
            )
            self._solver.start()
        return bool(wanted)

    def _take_solved(self) -> None:
        while self._solved:
            name, ratio, why = self._solved.popleft()
            if why:
                self._failed[name] = ratio, why
            elif name in self._wanted and self._engine.fill_known(name, ratio):
                self._set(name, ratio)  # nearer than the one before, if it is no longer wanted

    def _tell_errors(self) -> None:
        self._told = True
        if self._impossible:
            self._news.tell('no table', _ONE_BY_ONE + self._impossible)
        for name, (error, of_solutions) in self._engine.fill_errors().items():
            text = f'the liquid of {name} is interpolated over the fill to {error:.1g}'
            if of_solutions:
                text += f', between solutions good to {of_solutions:.1g}'
            level = INFO if error < _COARSE else WARNING
            self._news.tell(f'error of {name}', text, level)

    def _set(self, name: str, ratio: float) -> None:
        before = self._engine.fill_ratio(name)
        if self._engine.set_fill(name, ratio):
            self.changed = True
        if ratio != before:
            self._news.tell(f'fill of {name}', f'{name} is filled to {ratio:.4g}', INFO)

    def _say_no(self, error: InputError) -> None:
        self._watch.refuse(REFUSED)
        self._news.tell(REFUSED, str(error))
