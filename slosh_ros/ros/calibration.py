"""The service `~/calibrate`: call it while the vehicle stands still, wait, read the answer."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from slosh_ros.engine import Loads, SloshEngine, Verdict
from slosh_ros.engine.calibration import Assumption, Calibration
from slosh_ros.errors import InputError
from slosh_ros.parameters import Values

_PATIENCE = 10.0  # [s] of wall time beyond three times the duration: slow clocks, first samples
_JOIN = 2.0  # [s]


class CalibrationService:
    """
    Collects the samples of a vehicle at rest and writes what they tell into a parameter file.

    Its callback waits until all samples are there, which must not hold up the node. So a hidden
    node in a thread of its own offers it; the EventsExecutor knows no callbacks that wait.

    Parameters
    ----------
    node : Node
        Whose service it is.
    engine : SloshEngine
        Of the samples.
    values : Values
        The parameters `calibration.*`.
    """

    def __init__(self, node: Node, engine: SloshEngine, values: Values) -> None:
        self._engine = engine
        self._duration = values.number('calibration.duration')
        self._assumption = _ASSUMPTIONS[values.string('calibration.finds')]
        self._file = Path(values.string('calibration.file')).expanduser().absolute()
        self._running: Calibration | None = None
        self._collected: SimpleQueue[Calibration | None] = SimpleQueue()
        self._node = rclpy.create_node(
            f'_{node.get_name()}_calibration',
            namespace=node.get_namespace(),
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._node.create_service(
            Trigger, node.resolve_service_name('~/calibrate'), self._on_calibrate
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = Thread(target=self._serve, daemon=True)
        self._thread.start()

    def take(self, verdict: Verdict, loads: Loads) -> None:
        """Take an accepted sample, if they are being collected; after a gap they begin anew."""
        running = self._running
        if running is None:
            return
        if verdict is not Verdict.ACCEPTED:
            running = self._running = Calibration(self._engine.config.imu)
        running.take(loads.sample)
        if running.duration >= self._duration:
            self._running = None
            self._collected.put(running)

    def close(self) -> None:
        """End the thread; a call that waits is told so, if there is time to."""
        self._collected.put(None)
        self._executor.shutdown(timeout_sec=_JOIN)
        self._thread.join(_JOIN)
        self._node.destroy_node()

    def _serve(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()

    def _on_calibrate(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message = self._calibrate()
            response.success = True
        except InputError as error:
            response.message = str(error)
        return response

    def _calibrate(self) -> str:
        if self._engine.config.source != 'imu':
            raise InputError('there is no IMU to calibrate: input.source is twist')
        self._collected = SimpleQueue()
        self._running = Calibration(self._engine.config.imu)
        patience = 3.0 * self._duration + _PATIENCE
        try:
            collected = self._collected.get(timeout=patience)
        except Empty:
            raise InputError(
                f'no {self._duration:g} s of samples without a gap came within {patience:g} s; '
                '/diagnostics tells why'
            ) from None
        finally:
            self._running = None
        if collected is None:
            raise InputError('the node is ending')
        result = collected.result(self._assumption)
        try:
            self._file.write_text(result.yaml(), encoding='ascii')
        except OSError as error:
            raise InputError(f'{self._file} cannot be written: {error.strerror}') from error
        found = ', '.join(
            f'{name} = [{", ".join(f"{value:.6f}" for value in values)}]'
            for name, values in result.parameters.items()
        )
        return (
            f'{found}, from {result.samples} samples over {result.duration:.1f} s; written to '
            f'{self._file}: start slosh_node with it as a last --params-file'
        )


_ASSUMPTIONS = {'bias': Assumption.BIAS, 'mount': Assumption.MOUNT}
