"""Moving pictures of truck and liquid: GIF by Pillow, MP4 by ffmpeg. matplotlib comes along."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from math import ceil
from pathlib import Path
from shutil import which
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Polygon, Rectangle
from matplotlib.transforms import Affine2D, Transform
from numpy.typing import NDArray
from PIL import Image
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import griddata

from slosh_ros.bag import Recording
from slosh_ros.engine import SloshEngine
from slosh_ros.errors import InputError
from slosh_ros.study.plots import COLOURS, STYLES, mark_contacts
from slosh_ros.vehicle import Drive, History, TankLiquid
from slosh_ros.vehicle.scenario import Scenario

Array = NDArray[np.float64]
Progress = Callable[[float], None]
Painter = Callable[[int], NDArray[np.uint8]]  # pixels (height, width, 3) of a frame

FRAME = 0.08  # [s] from frame to frame; GIF counts hundredths of a second
MANY_FRAMES = 400  # what takes more is shown faster
FRAMES_PER_WAVE = 8  # at least, at the mean frequency of the waves
_COLOURS = 48  # of a GIF, the same for all frames: it then stays small
_LIQUID, _WALL, _BODY, _TYRE, _ROAD = '#9ecae8', '#333333', '#a6a6a6', '#404040', '#d5d0c4'
_FAR = 100.0  # [m] beyond every picture
_WHEEL = 0.5  # [m] radius, for the picture only, as all that has no other source here
_PER_LOAD = 8e-6  # [m/N] of the bars under the wheels
_PER_ACCELERATION = 0.1  # [s^2/m] of the arrows, in widths of the view
_SIDE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # from the right: x and z of base_link
_REAR = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])  # from behind: -y and z


def check_target(path: Path) -> None:
    """
    Refuse early a file that cannot become a moving picture.

    Raises
    ------
    InputError
        If its ending is neither `.gif` nor `.mp4`, or it wants an ffmpeg that is not there.
    """
    if path.suffix not in ('.gif', '.mp4'):
        raise InputError(f"{path}: its ending must be .gif or .mp4, not '{path.suffix}'")
    if path.suffix == '.mp4' and which('ffmpeg') is None:
        raise InputError(
            f'{path}: an MP4 is written by ffmpeg, which is not on the PATH; install it (on '
            'Ubuntu: apt install ffmpeg), or name a .gif'
        )


def animate_history(
    scenario: Scenario,
    tanks: Sequence[TankLiquid],
    history: History,
    name: str,
    path: Path,
    progress: Progress,
) -> None:
    """
    Show a simulated drive: truck and surface from the right and from behind.

    Parameters
    ----------
    scenario : Scenario
        The drive.
    tanks : sequence of TankLiquid
        The tanks of slosh_node; not needed with Table 4, which has its own.
    history : History
        The result.
    name : str
        Title.
    path : Path
        GIF or MP4 file.
    progress : callable
        Told the time that has been drawn [s].
    """
    tanks = replace(scenario, solid=False).sloshing(tanks).tanks
    modes = sum(len(tank.names) for tank in tanks)
    beta = np.zeros((len(history.time), modes)) if scenario.solid else history.beta
    frames, pace = choose_frames(history.time, beta)
    stage = Stage(name + pace, tanks)
    truck = TruckPicture(stage, scenario, history.wheel_loads[0])
    stage.draw_forces(history.time, history.slosh)
    mark_contacts(stage.strip, history.contacts, float(history.time[-1]))
    quantities = (
        *(beta, history.acceleration, history.q, history.wheel_loads, history.distance),
        *(history.speed, history.transfer.vehicle, history.valid.astype(float)),
    )
    beta, acceleration, q, loads, distance, speed, transfer, valid = (
        _interpolated(frames, history.time, values) for values in quantities
    )

    def show(k: int) -> None:
        truck.show(float(distance[k]), q[k], loads[k])
        pitch, roll = np.degrees(q[k, 4:])
        numbers = f'{speed[k]:5.2f} m/s   pitch {pitch:+5.1f}°   roll {roll:+5.1f}°   '
        numbers += f'load transfer {transfer[k]:+5.2f}'
        lifted = [str(i + 1) for i in np.flatnonzero(loads[k].min(axis=1) < 0.0)]
        warnings = [_BEYOND] * bool(valid[k] < 0.5)
        warnings += ['would lift off: axle ' + ', '.join(lifted)] * bool(lifted)
        stage.show(frames[k], beta[k], acceleration[k], numbers, '; '.join(warnings))

    _render(stage, show, frames, path, progress)


def animate_replay(
    recording: Recording, engine: SloshEngine, name: str, path: Path, progress: Progress
) -> None:
    """
    Show a replayed drive: the tanks, drawn level, from the right and from behind.

    Parameters
    ----------
    recording : Recording
        The drive.
    engine : SloshEngine
        Whose tanks they are.
    name : str
        Title.
    path : Path
        GIF or MP4 file.
    progress : callable
        Told the time that has been drawn [s].

    Raises
    ------
    InputError
        If the fill of a tank changes.
    """
    if recording.liquids > 1:
        raise InputError(
            f'{path}: cannot show a fill that changes; choose a part of the bag in which it does '
            'not, with --start and --duration'
        )
    time = recording.time
    frames, pace = choose_frames(time, recording.beta)
    tanks = []
    for tank in engine.tanks:
        config, c = tank.config, tank.coefficients
        at = config.pose.origin, config.pose.rotation
        tanks.append(TankLiquid.of(c, tank.damping_ratio, *at, tank=config.tank))
    felt_as = 'specific force' if recording.source == 'imu' else 'acceleration'
    stage = Stage(name + pace, tanks, felt_as)
    stage.draw_forces(time, recording.wrench)
    for view in (stage.side, stage.rear):
        view.frame()
    # as the mean around each frame: samples come faster, and shake
    if recording.source == 'imu':
        gained = cumulative_trapezoid(recording.force, time, axis=0, initial=0.0)
    else:  # v' + omega x v
        turning = np.cross(recording.rate, recording.velocity)
        gained = recording.velocity + cumulative_trapezoid(turning, time, axis=0, initial=0.0)
    felt = np.gradient(_interpolated(frames, time, gained), frames, axis=0)
    beta, wave, valid = (
        _interpolated(frames, time, values)
        for values in (recording.beta, recording.elevation_max, recording.valid.astype(float))
    )

    def show(k: int) -> None:
        warning = _BEYOND if valid[k] < 0.5 else ''
        stage.show(frames[k], beta[k], felt[k], f'wave height {wave[k]:5.2f} m', warning)

    _render(stage, show, frames, path, progress)


_BEYOND = 'wave beyond linear theory: drawn only inside the wall'


def walls_of(liquid: TankLiquid) -> tuple[Array, Array]:
    """
    Outline a tank in its middle planes, x, z and y, z, about O, each (k, 2) [m].

    Raises
    ------
    InputError
        If nobody knows where its walls are.
    """
    tank, c = liquid.tank, liquid.coefficients
    assert tank is not None
    assert c is not None
    along, across = tank.outlines()
    return along - c.liquid.surface_centre[[0, 2]], across - c.liquid.surface_centre[1:]


class _Cut:
    """The liquid in a middle plane of a tank (0: x, z; 1: y, z), as a view shows it."""

    def __init__(self, liquid: TankLiquid, plane: int, view: Array) -> None:
        wall = walls_of(liquid)[plane]
        assert liquid.coefficients is not None
        points = liquid.coefficients.surface_points
        centre = view @ liquid.origin
        along, self._up = (view @ liquid.rotation[:, axis] for axis in (plane, 2))
        self.wall: Array = centre + np.outer(wall[:, 0], along) + np.outer(wall[:, 1], self._up)
        line, moves = np.zeros((101, 2)), len(points) > 0  # in an empty or full tank nothing does
        reach = points[:, plane] if moves else wall[:, 0]
        line[:, plane] = np.linspace(reach.min(), reach.max(), len(line))
        shapes: Array = np.zeros((len(line), 0))
        if moves:
            shapes = griddata(points, liquid.coefficients.surface_shapes, line)
        known = np.isfinite(shapes).all(axis=1)
        self._shapes: Array = shapes[known]
        # and on beyond the contact lines, where the wall may lean outwards
        self._place: Array = np.concatenate([[-_FAR], line[known, plane], [_FAR]])
        self._mean: Array = centre + np.outer(self._place, along)

    @property
    def width(self) -> float:
        """Width of the tank in the view [m]."""
        return float(np.ptp(self.wall[:, 0]))

    def liquid(self, beta: Array) -> Array:
        """All (k, 2) that is below the surface; beyond the contact lines it goes straight on."""
        inner, place = self._shapes @ beta, self._place
        slopes = np.diff(inner)[[0, -1]] / np.diff(place)[[1, -2]]
        ends = inner[[0, -1]] + slopes * (place[[0, -1]] - place[[1, -2]])
        rise = np.concatenate([ends[:1], inner, ends[1:]])
        surface = self._mean + np.outer(rise, self._up)
        return np.vstack([surface, surface[[-1, 0]] - 1e3 * _FAR * self._up])


class View:
    """
    One of the two views on the tanks.

    Attributes
    ----------
    axes : Axes
        Where it is drawn.
    pose : Affine2D
        Of base_link in the view.
    """

    def __init__(self, axes: Axes, tanks: Sequence[TankLiquid], view: Array, label: str) -> None:
        axes.set_aspect('equal')
        axes.tick_params(labelsize=7)
        axes.set_xlabel(label, fontsize=8, labelpad=1.0)
        axes.set_ylabel('z [m]', fontsize=8)
        self.axes = axes
        self.pose = Affine2D()
        at = self.pose + axes.transData
        self._cuts = [
            max((_Cut(tank, plane, view) for plane in (0, 1)), key=lambda cut: cut.width)
            for tank in tanks
        ]
        self._liquids = []
        for cut in self._cuts:
            wall = self.add(cut.wall, at, facecolor='white', zorder=2)
            liquid = self.add(cut.wall, at, facecolor=_LIQUID, edgecolor=COLOURS['x'], zorder=3)
            liquid.set_clip_path(wall)  # it stays inside
            self.add(cut.wall, at, fill=False, edgecolor=_WALL, linewidth=1.3, zorder=4)
            self._liquids.append(liquid)
        self.walls: Array = np.vstack([cut.wall for cut in self._cuts])
        self._root = (self.walls.min(axis=0) + self.walls.max(axis=0)) / 2.0
        self._arrow = axes.annotate(
            '', (0.0, 0.0), (0.0, 0.0), zorder=6, annotation_clip=False,
            arrowprops={'arrowstyle': '-|>', 'color': COLOURS['y'], 'linewidth': 2.0},
        )  # fmt: skip

    def add(self, points: Array, at: Transform | None = None, **style: Any) -> Polygon:
        """Add a shape, in the coordinates of the view unless told otherwise."""
        polygon = Polygon(points, closed=True, transform=at or self.axes.transData, **style)
        self.axes.add_patch(polygon)
        return polygon

    @property
    def artists(self) -> list[Artist]:
        """All that is drawn in the axes, from the back to the front."""
        drawn = [*self.axes.patches, *self.axes.lines, *self.axes.texts]
        return sorted(drawn, key=lambda artist: artist.get_zorder())

    def frame(self) -> None:
        """Show the tanks and a little around them."""
        margin = 0.2 * np.ptp(self.walls, axis=0).min()
        low, high = self.walls.min(axis=0) - margin, self.walls.max(axis=0) + margin
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))

    def show(self, betas: Sequence[Array], acceleration: float) -> None:
        """Move the surfaces, and point an acceleration [m/s^2] to the right (or left)."""
        for cut, liquid, beta in zip(self._cuts, self._liquids, betas, strict=True):
            liquid.set_xy(cut.liquid(beta))
        x, z = self.pose.transform(self._root)
        self._arrow.set_position((x, z))
        left, right = self.axes.get_xlim()
        self._arrow.xy = (x + _PER_ACCELERATION * (right - left) * acceleration, z)


class Stage:
    """
    The picture: views from the right and from behind, forces over time, a line of numbers.

    Attributes
    ----------
    figure : Figure
        640 x 480 pixels.
    side, rear : View
        The views.
    strip : Axes
        With time along x.
    """

    def __init__(self, name: str, tanks: Sequence[TankLiquid], what: str = 'acceleration') -> None:
        self._what = what
        self.figure = Figure(figsize=(6.4, 4.8), dpi=100)
        place = self.figure.add_axes
        self.side = View(place((0.07, 0.54, 0.91, 0.33)), tanks, _SIDE, 'x [m]')
        self.rear = View(place((0.07, 0.09, 0.33, 0.33)), tanks, _REAR, 'to the right [m]')
        self.strip = place((0.48, 0.09, 0.37, 0.33))
        self._ends = np.cumsum([len(tank.names) for tank in tanks])[:-1]
        write = self.figure.text
        write(0.02, 0.955, name, fontsize=9, weight='bold')
        self._numbers = write(0.02, 0.915, '', fontsize=8, family='monospace')
        self._warning = write(0.98, 0.955, '', fontsize=8, color=COLOURS['y'], ha='right')
        self._titles = write(0.07, 0.88, '', fontsize=8), write(0.07, 0.43, '', fontsize=8)

    @property
    def moving(self) -> list[Artist]:
        """What changes from frame to frame, from the back to the front."""
        views = [c for view in (self.side, self.rear) for c in view.artists]
        return [*views, self._cursor, self._numbers, self._warning, *self._titles]

    def draw_forces(self, time: Array, slosh: Array) -> None:
        """Draw the sloshing force (N, 6) [N] over time [s]."""
        strip = self.strip
        for k, axis, label in ((0, 'x', 'forward'), (1, 'y', 'left')):
            strip.plot(
                time, slosh[:, k] / 1e3, STYLES[axis], color=COLOURS[axis], label=label,
                linewidth=1.0,
            )  # fmt: skip
        self._cursor = strip.axvline(0.0, color='k', linewidth=0.8)
        strip.set_title('sloshing force [kN]', fontsize=8)
        strip.set_xlabel('time [s]', fontsize=8, labelpad=1.0)
        strip.tick_params(labelsize=7)
        strip.margins(x=0.0)
        strip.grid(alpha=0.3)
        strip.legend(loc='upper left', bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=7)

    def show(
        self, time: float, beta: Array, acceleration: Array, numbers: str, warning: str
    ) -> None:
        """Set the picture to an instant; acceleration is forward and to the left [m/s^2]."""
        betas = np.split(beta, self._ends)
        forward, left = acceleration[:2].tolist()
        self.side.show(betas, forward)
        self.rear.show(betas, -left)
        self._titles[0].set_text(f'from the right; {self._what} forward {forward:+.2f} m/s²')
        self._titles[1].set_text(f'from behind; to the left {left:+.2f} m/s²')
        self._cursor.set_xdata([time, time])
        self._numbers.set_text(f't = {time:6.2f} s   {numbers}')
        self._warning.set_text(warning)


class TruckPicture:
    """
    Bodies, wheels, wheel loads and road, added to the views.

    Parameters
    ----------
    stage : Stage
        What they are added to.
    scenario : Scenario
        The drive.
    rest : array, shape (4, 2)
        Wheel loads at rest [N].
    """

    def __init__(self, stage: Stage, scenario: Scenario, rest: Array) -> None:
        self._plan = plan = scenario.plan
        p = plan.truck.parameters
        if isinstance(plan, Drive):
            g = plan.truck.parameters
            self._heights = g.tractor_height, g.semitrailer_height, g.semitrailer_roll_axis
            half = g.track[3] / 2.0
        else:  # nothing leans
            base = plan.truck.parameters.base_height
            self._heights, half = (1.0, base, base), 0.93
        self._places = -p.l_w1, -(p.l_w1 + p.l_bt + p.l_bs)
        self._axles, self._sides = -p.wheel_offsets, np.array([-half, half])
        self._side, self._rear, self._tractor = stage.side, stage.rear, Affine2D()
        tail = min(float(self._axles[-1]), self._places[1] + float(self._side.walls[:, 0].min()))
        self._along = np.linspace(tail - 0.9, 2.2, 300)
        self._side.axes.set(xlim=(self._along[0], self._along[-1]), ylim=(-2.0, 4.9))
        self._rear.axes.set(xlim=(-2.6, 2.6), ylim=(-2.0, 4.9))
        legend = 'bars: wheel loads\nframes: at rest\norange: would\n  lift off'
        stage.figure.text(0.865, 0.1, legend, fontsize=7)
        self._draw_bodies(p.l_w1, max(p.l_w2, p.l_bt), p.l_bs, p.l_w4)

        side, rear = self._side, self._rear
        ground: dict[str, Any] = {'facecolor': _ROAD, 'edgecolor': '0.6'}
        self._roads = [side.add(_box(1.0, 1.0), zorder=z, **ground) for z in (0.5, 0.6)]
        self._under = rear.add(_box(1.0, 1.0), zorder=0.5, **ground)
        (self._posts,) = side.axes.plot([], [], '|', color='0.5', markersize=5, zorder=0.7)
        self._wheels = [Circle((x, 0.0), _WHEEL, zorder=5) for x in self._axles]
        for wheel in self._wheels:
            side.axes.add_patch(wheel)
        self._tyres = [rear.add(_box(0.3, 1.0), zorder=1.5) for _ in self._sides]
        self._bars = [
            _Bar(view, x, load)
            for view, places, loads in (
                (side, self._axles, rest.sum(axis=1)),
                (rear, self._sides, rest[2:].sum(axis=0)),
            )
            for x, load in zip(places, loads, strict=True)
        ]

    def _draw_bodies(self, front: float, back: float, hitch: float, rear: float) -> None:
        """Draw chassis and cab about their mass centres, so far [m] ahead and behind."""
        style: dict[str, Any] = {'facecolor': _BODY, 'edgecolor': _WALL, 'linewidth': 0.8}
        tractor = self._tractor + self._side.axes.transData
        trailer = self._side.pose + self._side.axes.transData
        nose, tail = front + 1.2, -back - 0.7
        self._side.add(_beam(tail, nose, -0.35, -0.05), tractor, **style)
        cab = [[1.0, 0.0], [nose, 0.0], [nose, 1.1], [nose - 0.5, 2.1], [1.0, 2.1]]
        self._side.add(np.array(cab), tractor, **style)
        self._side.add(_beam(-rear - 0.9, hitch + 0.6, -0.28, -0.03), trailer, **style)
        behind = self._rear.pose + self._rear.axes.transData
        self._rear.add(_beam(-1.1, 1.1, -0.28, -0.03), behind, **style)

    def show(self, distance: float, q: Array, loads: Array) -> None:
        """Move to a place along the road [m], with deviations (6,) and wheel loads (4, 2)."""
        z_t, theta_t, _, z_s, theta_s, phi_s = q.tolist()
        h_t, h_s, axis = self._heights
        # from the right, nose down is clockwise; from behind, so is left side up
        self._tractor.clear().rotate(-theta_t).translate(self._places[0], h_t + z_t)
        self._side.pose.clear().rotate(-theta_s).translate(self._places[1], h_s + z_s)
        self._rear.pose.clear().translate(0.0, h_s - axis).rotate(-phi_s)
        self._rear.pose.translate(0.0, axis + z_s)
        heights = self._road(distance + self._along)
        for road, height in zip(self._roads, heights.T, strict=True):  # the right one in front
            road.set_xy(_down(self._along, height))
        posts = np.arange(-distance % 5.0 - 25.0, self._along[-1], 5.0)
        self._posts.set_data(posts, np.interp(posts, self._along, heights[:, 1]) - 0.12)
        heights = self._road(distance + self._axles)
        for wheel, z, load in zip(self._wheels, heights.mean(axis=1), loads, strict=True):
            wheel.center = (wheel.center[0], z + _WHEEL)
            _colour(wheel, load, _TYRE)
        ends = np.array([-_FAR, *self._sides, _FAR])
        self._under.set_xy(_down(ends, np.repeat(heights[3], 2)))
        for tyre, x, z, load in zip(
            self._tyres, self._sides, heights[3], loads[2:].T, strict=True
        ):
            tyre.set_xy(_beam(x - 0.15, x + 0.15, z, z + 2.0 * _WHEEL))
            _colour(tyre, load, _TYRE)
        carried = [*loads.sum(axis=1), *loads[2:].sum(axis=0)]
        for bar, load in zip(self._bars, carried, strict=True):
            bar.show(load)

    def _road(self, position: Array) -> Array:
        """Heights (..., 2) of the road, left and right, at positions [m]."""
        if isinstance(self._plan, Drive):
            return self._plan.road.under(position)[0]
        return np.repeat(self._plan.road.elevation(position)[:, np.newaxis], 2, axis=1)


class _Bar:
    """A load that hangs under the road; an empty bar shows it at rest."""

    def __init__(self, view: View, x: float, rest: float) -> None:
        corner = x - 0.2, -0.25
        frame = Rectangle(corner, 0.4, -rest * _PER_LOAD, fill=False, edgecolor='0.4', zorder=5)
        self._bar = Rectangle(corner, 0.4, 0.0, zorder=4)
        view.axes.add_patch(frame)
        view.axes.add_patch(self._bar)

    def show(self, load: float) -> None:
        """Show a load [N]."""
        self._bar.set_height(-abs(load) * _PER_LOAD)
        _colour(self._bar, np.array(load), COLOURS['z'])


def _colour(patch: Patch, loads: Array, good: str) -> None:
    """Colour what carries loads [N]; one that would pull at the road stands out."""
    patch.set_color(COLOURS['y'] if loads.min() < 0.0 else good)


def _box(width: float, height: float) -> Array:
    """Corners (4, 2) of an upright box about its middle [m]."""
    return _beam(-width / 2.0, width / 2.0, -height / 2.0, height / 2.0)


def _beam(left: float, right: float, low: float, high: float) -> Array:
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def _down(x: Array, height: Array) -> Array:
    """Close a line to the ground below it."""
    return np.vstack([np.column_stack([x, height]), [[x[-1], -_FAR], [x[0], -_FAR]]])


def choose_frames(time: Array, beta: Array) -> tuple[Array, str]:
    """
    Choose the instants to show [s], and words for a pace that is not that of the drive.

    A long drive is shown faster, but not so fast that its waves are no longer seen to move.
    """
    duration = float(time[-1])
    rate = np.gradient(beta, time, axis=0) if len(time) > 1 else np.zeros_like(beta)
    period = 2.0 * np.pi * np.sqrt(np.sum(beta**2) / max(float(np.sum(rate**2)), 1e-12))
    fastest = max(1, int(period / FRAMES_PER_WAVE / FRAME))
    pace = max(1, min(ceil(duration / FRAME / MANY_FRAMES), fastest))
    frame = pace * FRAME
    count = max(2, int(duration / frame + 1e-6) + 1)
    instants = frame * np.arange(count, dtype=np.float64)
    return instants, f'   ({pace} x)' if pace > 1 else ''


def _interpolated(times: Array, time: Array, values: Array) -> Array:
    """Take values (N, ...) at other times, linearly in between."""
    columns = values.reshape(len(time), -1).T
    found = np.array([np.interp(times, time, column) for column in columns])
    return found.T.reshape(len(times), *values.shape[1:])


def _render(
    stage: Stage, show: Callable[[int], None], frames: Array, path: Path, progress: Progress
) -> None:
    """Draw frame by frame into a file."""
    check_target(path)
    pixels = _painter(stage, show)
    try:
        if path.suffix == '.gif':
            _write_gif(path, pixels, frames, progress)
        else:
            _write_mp4(path, pixels, frames, progress)
    except OSError as error:
        raise InputError(f'{path}: the picture cannot be written: {error}') from error


def _painter(stage: Stage, show: Callable[[int], None]) -> Painter:
    """Draw what moves over what does not, which takes a fifth of the time of all."""
    figure = stage.figure
    canvas: Any = FigureCanvasAgg(figure)
    for artist in stage.moving:
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)

    def pixels(k: int) -> NDArray[np.uint8]:
        show(k)
        canvas.restore_region(background)
        for artist in stage.moving:
            figure.draw_artist(artist)
        return np.array(canvas.buffer_rgba())[..., :3]

    return pixels


def _write_gif(path: Path, pixels: Painter, frames: Array, progress: Progress) -> None:
    """Write all frames with one palette, from some of them: they then hardly differ."""
    some = np.linspace(0, len(frames) - 1, 5).round().astype(int)
    samples = Image.fromarray(np.vstack([pixels(k) for k in some]))
    palette = samples.quantize(_COLOURS, Image.Quantize.MAXCOVERAGE)

    def images() -> Iterator[Image.Image]:
        for k, time in enumerate(frames.tolist()):
            image = Image.fromarray(pixels(k))
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)
            progress(time)

    rest = images()
    next(rest).save(path, save_all=True, append_images=rest, duration=round(1e3 * FRAME), loop=0)


def _write_mp4(path: Path, pixels: Painter, frames: Array, progress: Progress) -> None:
    """Send all frames to ffmpeg."""
    height, width, _ = pixels(0).shape
    given = f'-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {1.0 / FRAME} -i -'
    command = ['ffmpeg', '-loglevel', 'error', '-y', *given.split(), '-pix_fmt', 'yuv420p']
    with subprocess.Popen(
        [*command, str(path.absolute())], stdin=subprocess.PIPE, stderr=subprocess.PIPE
    ) as ffmpeg:
        assert ffmpeg.stdin is not None
        with suppress(BrokenPipeError):  # it has said why
            for k, time in enumerate(frames.tolist()):
                ffmpeg.stdin.write(pixels(k).tobytes())
                progress(time)
        said = ffmpeg.communicate()[1].decode(errors='replace')
    if ffmpeg.returncode:
        raise OSError(' '.join(said.split()))
