"""Moving pictures: what is drawn is where physics puts it, and the files are what they say."""

from __future__ import annotations

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from PIL import Image
from test_bad_input import refused
from test_replay import slosh

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import coefficients_of
from slosh_ros.study.animation import FRAME, Stage, TruckPicture, View, choose_frames
from slosh_ros.tank import Tank, cylinder_x, cylinder_z, ellipse_x, rectangular, section_x
from slosh_ros.vehicle import TankLiquid
from slosh_ros.vehicle.scenario import Scenario

Array = NDArray[np.float64]

SCENARIOS = REPOSITORY / 'config' / 'scenarios'
TANKS = {
    'cylinder_x': cylinder_x(1.125, 4.0),
    'rectangular': rectangular(3.0, 2.0, 1.5),
    'cylinder_z': cylinder_z(1.0, 2.0),
    'ellipse_x': ellipse_x(2.4, 1.6, 4.0),
    'section_x': section_x([-1.0, -0.7, 0.6, -0.7, 1.2, 0.2, 0.7, 0.9, -1.0, 0.6], 4.0),
}


def filled(tank: Tank, fill: float, modes: int = 8) -> TankLiquid:
    c = coefficients_of(tank, tank.depth(fill), 1000.0, modes)
    return TankLiquid.of(c, np.zeros(modes), np.array([0.0, 0.0, 1.0]), tank=tank)


def framed(*tanks: TankLiquid) -> Stage:
    stage = Stage('', tanks)
    stage.draw_forces(np.array([0.0, 1.0]), np.zeros((2, 6)))
    for view in (stage.side, stage.rear):
        view.frame()
    return stage


def shown(stage: Stage, beta: Array, acceleration: Array | None = None) -> None:
    stage.show(0.0, beta, np.zeros(2) if acceleration is None else acceleration, '', '')


def painted(stage: Stage, view: View) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which pixels show liquid, and which lie within the wall."""
    view._arrow.set_visible(False)
    for patch in view.axes.patches:
        patch.set_linewidth(0.0)
    stage.figure.set_dpi(200)
    canvas = FigureCanvasAgg(stage.figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255.0  # from the bottom up
    there = view.axes.get_window_extent()
    x, y = (np.arange(round(low), round(high)) for low, high in (there.intervalx, there.intervaly))
    liquid = np.all(np.abs(pixels[np.ix_(y, x)] - to_rgb('#9ecae8')) < 0.01, axis=-1)
    corners = (view.pose + view.axes.transData).transform(view.walls)
    centres = np.stack(np.meshgrid(x + 0.5, y + 0.5), axis=-1)
    inside = Outline(corners).contains_points(centres.reshape(-1, 2)).reshape(liquid.shape)
    return liquid, inside


@pytest.mark.parametrize('name', TANKS)
@pytest.mark.parametrize('fill', [0.3, 0.8])
def test_at_rest_the_picture_is_filled_to_the_level(name: str, fill: float) -> None:
    stage = framed(filled(TANKS[name], fill))
    tank = TANKS[name]
    shown(stage, np.zeros(8))
    side, rear = (painted(stage, view) for view in (stage.side, stage.rear))
    level = tank.depth(fill) / tank.height
    across = fill  # by area of the section
    for (liquid, inside), share in ((side, level), (rear, across)):
        assert liquid.sum() / inside.sum() == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize('name', TANKS)
@pytest.mark.parametrize('height', [-3.0, 0.4])
def test_liquid_stays_inside_the_wall_however_high_the_wave(name: str, height: float) -> None:
    stage = framed(filled(TANKS[name], 0.5))
    shown(stage, height * np.array([1.0, 1.0, 0.3, 0.3, 0.1, 0.1, 0.0, 0.0]))
    for view in (stage.side, stage.rear):
        view.pose.rotate(0.1)  # as a truck that pitches and rolls
        liquid, inside = painted(stage, view)
        assert liquid.sum() > 0.05 * inside.sum()
        assert not (liquid & ~inside).any()


@pytest.mark.parametrize('name', TANKS)
@pytest.mark.parametrize(('axis', 'view'), [(0, 'side'), (1, 'rear')])
def test_surface_leans_against_a_steady_acceleration(name: str, axis: int, view: str) -> None:
    """At rest under s the surface is a plane: zeta = -s x / g."""
    p = filled(TANKS[name], 0.5, 60)
    modes, felt = p.modes, 0.1 * GRAVITY
    beta = -modes.coupling[:, axis] * felt / (modes.mu * modes.omega**2)
    stage = framed(p)
    shown(stage, beta)
    (cut,) = getattr(stage, view)._cuts
    x, z = cut.liquid(beta)[1:-3].T  # without what is drawn beyond the wall
    half = np.abs(x).max()
    inner = np.abs(x) < 0.9 * half  # the modes' sum converges slowly at the wall
    away = -0.1 if view == 'side' else 0.1  # from behind, the left is on the left
    surface = p.origin[2]
    np.testing.assert_allclose(z[inner] - surface, away * x[inner], atol=0.012 * half)


def test_arrow_points_where_the_truck_is_pushed() -> None:
    stage = framed(filled(TANKS['rectangular'], 0.5))
    shown(stage, np.zeros(8), np.array([-0.98, 2.0]))  # brakes, and turns to the left
    for view, sign in ((stage.side, -1.0), (stage.rear, -1.0)):
        assert np.sign(view._arrow.xy[0] - view._arrow.get_position()[0]) == sign


def test_turned_and_several_tanks_are_drawn_where_they_are() -> None:
    whole = filled(TANKS['rectangular'], 0.5)  # 3 m long, 2 m wide
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    across = replace(whole, origin=np.array([5.0, 1.0, 0.0]), rotation=quarter)
    stage = framed(whole, across)
    shown(stage, np.zeros(16))
    one, other = (cut.wall for cut in stage.side._cuts)
    behind = stage.rear._cuts[1].wall  # to the left of the middle, now 3 m wide
    for wall, low, high in (
        (one, [-1.5, 0.25], [1.5, 1.75]),
        (other, [4.0, -0.75], [6.0, 0.75]),
        (behind, [-2.5, -0.75], [0.5, 0.75]),
    ):
        np.testing.assert_allclose(wall.min(axis=0), low)
        np.testing.assert_allclose(wall.max(axis=0), high)


# the truck


@pytest.fixture(scope='module')
def bumpy() -> tuple[Scenario, Stage]:
    scenario = Scenario.from_file(SCENARIOS / 'one_sided_bump.yaml')
    tanker = replace(filled(cylinder_x(1.125, 14.0), 0.5), origin=np.array([0.0, 0.0, 1.12746]))
    return scenario, framed(tanker)


def test_wheels_stand_on_the_road_and_the_bodies_lean_as_they_should(bumpy) -> None:
    scenario, stage = bumpy
    truck = TruckPicture(stage, scenario, np.full((4, 2), 5e4))
    loads = np.full((4, 2), 5e4)
    level = np.zeros(6)
    crown = 10.0 + 3.7 / 2.0
    truck.show(crown + 15.3, level, loads)  # axle 3 on the crown, left wheels only
    lows = [wheel.center[1] - wheel.radius for wheel in truck._wheels]
    np.testing.assert_allclose(lows[:3], [0.0, 0.0, 0.05], atol=1e-12)
    truck.show(crown + 16.61, level, loads)
    low = [tyre.get_xy()[:, 1].min() for tyre in truck._tyres]
    np.testing.assert_allclose(low, [0.1, 0.0], atol=1e-12)  # from behind, left is left

    def corners(view: View) -> Array:
        return view.pose.transform(view.walls)

    still = [corners(view) for view in (stage.side, stage.rear)]
    truck.show(0.0, np.array([0.0, 0.0, 0.0, 0.0, 0.05, 0.1]), loads)
    side, rear = (corners(view) for view in (stage.side, stage.rear))
    nose, left = still[0][:, 0].argmax(), still[1][:, 0].argmin()
    assert side[nose, 1] < still[0][nose, 1] - 0.3  # nose down
    assert rear[left, 1] > still[1][left, 1] + 0.05  # left side up
    assert rear[:, 0].mean() > still[1][:, 0].mean() + 0.1  # high bodies lean to the right
    truck.show(0.0, np.array([0.0, 0.0, 0.0, 0.2, 0.0, 0.0]), loads)
    np.testing.assert_allclose(
        corners(stage.rear) - still[1], [[0.0, 0.2]] * len(rear), atol=1e-12
    )


def test_a_wheel_that_would_lift_off_stands_out(bumpy) -> None:
    scenario, stage = bumpy
    truck = TruckPicture(stage, scenario, np.full((4, 2), 5e4))
    loads = np.full((4, 2), 5e4)
    loads[3, 0] = -1e3
    truck.show(0.0, np.zeros(6), loads)
    colours = [wheel.get_facecolor() for wheel in truck._wheels]
    assert colours[3] != colours[2] == colours[1] == colours[0]
    left, right = (tyre.get_facecolor() for tyre in truck._tyres)
    assert left != right


# files


def shortened(folder: Path, name: str, seconds: float) -> Path:
    file = folder / f'{name}.yaml'
    text = (SCENARIOS / f'{name}.yaml').read_text()
    before, _, after = text.partition('duration: ')
    file.write_text(f'{before}duration: {seconds} #{after}')
    return file


@pytest.mark.dear
@pytest.mark.parametrize('name', ['paper_brake_bump', 'step_steer'])
def test_gif_of_a_scenario_moves_at_the_pace_of_the_drive(tmp_path, name):
    out = tmp_path / 'drive.gif'
    result = slosh('simulate', shortened(tmp_path, name, 3.2), '--animate', out)
    assert result.returncode == 0, result.stderr
    with Image.open(out) as gif:
        assert gif.size == (640, 480)
        assert gif.n_frames == pytest.approx(3.2 / FRAME + 1, abs=1)
        assert gif.info['duration'] == pytest.approx(1e3 * FRAME)
        seen = []
        for k in (0, 20, 40):
            gif.seek(k)
            seen.append(np.asarray(gif.convert('RGB'), dtype=int))
    assert out.stat().st_size < 400_000
    for one, other in ((0, 1), (1, 2)):
        assert np.mean(np.any(seen[one] != seen[other], axis=-1)) > 0.005


@pytest.mark.dear
def test_gif_of_a_solid_cargo_shows_a_level_surface(tmp_path):
    file = shortened(tmp_path, 'step_steer', 1.0)
    file.write_text(file.read_text().replace('cargo: liquid ', 'cargo: solid '))
    result = slosh('simulate', file, '--animate', tmp_path / 'solid.gif')
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize('source', ['imu', 'twist'])
def test_gif_of_a_replay(tmp_path, source):
    out = tmp_path / 'drive.gif'
    result = slosh(
        'replay', REPOSITORY / 'bags/highway_drive', '--duration', 2.0, '--animate', out,
        '--config', REPOSITORY / 'config/highway_drive.yaml',
        f'--{source}', '/imu/data' if source == 'imu' else '/twist',
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    with Image.open(out) as gif:
        assert gif.n_frames == pytest.approx(2.0 / FRAME, abs=2)


@pytest.mark.parametrize(
    ('seconds', 'period', 'pace'),
    [(0.0, 2.0, 1), (12.0, 9.4, 1), (70.0, 9.4, 3), (3600.0, 9.4, 14), (400.0, 1.0, 1)],
)
def test_a_long_drive_is_shown_faster_but_not_faster_than_its_waves(
    seconds: float, period: float, pace: int
) -> None:
    time = np.arange(0.0, seconds + 1e-9, 0.02)
    beta = np.sin(2.0 * np.pi / period * time)[:, np.newaxis]
    frames, words = choose_frames(time, beta)
    assert np.diff(frames) == pytest.approx(pace * FRAME)
    assert frames[0] == 0.0
    assert frames[-1] == pytest.approx(seconds, abs=pace * FRAME)
    assert words == (f'   ({pace} x)' if pace > 1 else '')
    if pace > 1:
        assert len(frames) <= 401 or pace * FRAME < period / 8.0 < (pace + 1) * FRAME


@pytest.mark.dear
def test_mp4_is_written_by_ffmpeg(tmp_path, monkeypatch):
    binary = pytest.importorskip('imageio_ffmpeg', reason='brings an ffmpeg').get_ffmpeg_exe()
    (tmp_path / 'bin').mkdir()
    (tmp_path / 'bin' / 'ffmpeg').symlink_to(binary)
    monkeypatch.setenv('PATH', f'{tmp_path / "bin"}:{os.environ["PATH"]}')
    out = tmp_path / 'drive.mp4'
    file = shortened(tmp_path, 'step_steer', 1.6)
    result = slosh('simulate', file, '--animate', out)
    assert result.returncode == 0, result.stderr
    told = subprocess.run([binary, '-i', out], capture_output=True, text=True, check=False).stderr
    assert '640x480' in told
    assert '12.50 fps' in told
    assert 'Duration: 00:00:01.6' in told
    nowhere = slosh('simulate', file, '--animate', tmp_path / 'none' / 'drive.mp4')
    assert nowhere.returncode == 1
    assert 'the picture cannot be written' in nowhere.stderr


def test_bad_targets(tmp_path, monkeypatch):
    scenario = SCENARIOS / 'step_steer.yaml'
    refused(['simulate', scenario, '--animate', 'x.avi'], 'its ending must be .gif or .mp4')
    monkeypatch.setenv('PATH', str(tmp_path))
    refused(['simulate', scenario, '--animate', 'x.mp4'], 'ffmpeg, which is not on the PATH')
    bag = REPOSITORY / 'bags/highway_drive'
    config = REPOSITORY / 'config/highway_drive.yaml'
    given = ['replay', bag, '--config', config, '--animate']
    refused([*given, 'x.png'], 'its ending must be .gif or .mp4')
    refused([*given, bag / 'x.gif'], 'lies in the bag')
