"""A fill that changes while the vehicle drives: continuity, action, books, ends."""

from __future__ import annotations

import itertools
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import SECOND, START, G
from numpy.typing import NDArray
from typer.testing import CliRunner

from slosh_ros.cli import app
from slosh_ros.engine import Loads, MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine import fill as engine_fill
from slosh_ros.engine.kinematics import Pose
from slosh_ros.errors import InputError
from slosh_ros.hydro import coefficients_of, volume, volume_sweep
from slosh_ros.hydro.volume import VolumeResolution, volume_coefficients
from slosh_ros.hydro.volume_sweep import VolumeSweep
from slosh_ros.tank import rectangular, section_x

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

BOX: dict[str, object] = {
    'tank.shape': 'rectangular', 'tank.length': 1.0, 'tank.width': 0.4, 'tank.height': 0.6,
    'tank.fill_ratio': 0.7, 'tank.modes': 3, 'tank.density': 850.0,
}  # fmt: skip
PIPE: dict[str, object] = {
    'tank.shape': 'cylinder_x', 'tank.length': 4.0, 'tank.radius': 1.2, 'tank.fill_ratio': 0.02,
    'tank.modes': 2, 'tank.damping_ratio': 0.02, 'tank.xyz': [1.0, 0.0, 0.5],
    'pressure.low': [2.0, 0.0, -1.1], 'pressure.high': [2.0, 0.0, 0.5],
}  # fmt: skip
VOLUME = 0.24
BALL: dict[str, object] = {
    'tank.shape': 'sphere', 'tank.radius': 0.9, 'tank.fill_ratio': 0.2, 'tank.modes': 3,
    'tank.damping_ratio': 0.2,
}  # fmt: skip
REST = (0.0, 0.0, G)


class Drive:
    """An engine and the samples that it is fed, one every step [s]."""

    def __init__(self, given: dict[str, object], step: float = 0.02, **more: object) -> None:
        given = given | {name.replace('__', '.'): value for name, value in more.items()}
        self.engine = SloshEngine(SloshConfig.from_parameters(given))
        self.step, self.count = step, 0

    def on(self, seconds: float, force: tuple[float, ...] = REST) -> Loads:
        """Drive on under a constant force."""
        for _ in range(max(1, round(seconds / self.step))):
            loads = self.one(force)
        return loads

    def one(self, force: tuple[float, ...] = REST) -> Loads:
        self.count += 1
        stamp = START + round(self.count * self.step * SECOND)
        _, loads = self.engine.feed(MotionSample.from_imu(stamp, list(force), [0.0] * 3))
        assert loads is not None
        return loads

    @property
    def action(self) -> float:
        """Energy of the first mode over its frequency."""
        return self.action_under(1.0)

    def action_under(self, gravity: float) -> float:
        """Of waves under another gravity, over the standard one."""
        (tank,) = self.engine.tanks
        c = tank.coefficients
        omega = c.omega[0] * np.sqrt(gravity)
        energy = 0.5 * c.mu[0] * (tank.beta_rate[0] ** 2 + (omega * tank.beta[0]) ** 2)
        return float(energy / omega)


# --- how the liquid goes on ----------------------------------------------------------------------


@pytest.mark.parametrize('end', [0.15, 0.95])
def test_a_free_wave_keeps_its_action_while_the_fill_changes_slowly(end: float) -> None:
    """Energy over frequency: the adiabatic invariant of mu(t) and omega(t)."""
    drive = Drive(BOX, tank__modes=1)
    drive.on(1.0, (0.3, 0.0, G))
    drive.on(0.5)
    (tank,) = drive.engine.tanks
    action, before = drive.action, tank.coefficients
    found, energy = [], action * before.omega[0]
    for fill in np.linspace(0.7, end, 300)[1:]:
        drive.engine.set_fill('tank', float(fill))
        drive.on(0.2)
        found.append(drive.action / action)
    after = drive.engine.tanks[0].coefficients
    assert np.abs(np.array(found) - 1.0).max() < 0.01
    # and neither the energy stays, nor what beta' alone would keep, beta^2 omega
    assert abs(drive.action * after.omega[0] / energy - 1.0) > 0.02
    assert abs(after.mu[0] / before.mu[0] - 1.0) > 0.02


def test_a_free_wave_keeps_its_action_under_measured_gravity() -> None:
    drive = Drive(BOX, tank__modes=1, model__gravity='measured')
    up = (0.0, 0.0, 1.6 * G)
    drive.on(1.0, (0.3, 0.0, 1.6 * G))
    drive.on(0.5, up)
    action, last, most = drive.action_under(1.6), 0.0, 0.0
    for fill in np.linspace(0.7, 0.3, 120)[1:]:
        drive.engine.set_fill('tank', float(fill))
        drive.on(0.2, up)
        last = drive.action_under(1.6) / action
        most = max(most, abs(last - 1.0))
    assert most < 0.01
    assert abs(drive.action / action - last) > 0.05  # under another gravity it is another one


def test_shallow_liquid_follows_greens_law() -> None:
    """Between walls of fixed distance the amplitude goes as depth^(1/4) (Green 1838)."""
    drive = Drive(BOX, tank__modes=1, tank__fill_ratio=0.04)
    drive.on(2.0, (0.01, 0.0, G))
    first = drive.action, drive.engine.tanks[0].coefficients
    for fill in np.linspace(0.04, 0.02, 200)[1:]:
        drive.engine.set_fill('tank', float(fill))
        drive.on(0.5)
    amplitudes = [
        np.sqrt(2.0 * action / (c.mu[0] * c.omega[0]))
        for action, c in (first, (drive.action, drive.engine.tanks[0].coefficients))
    ]
    assert amplitudes[1] / amplitudes[0] == pytest.approx(0.5**0.25, rel=0.01)


def test_filling_back_and_forth_creates_no_energy() -> None:
    """Going back undoes a change exactly; at random instants the action hardly wanders."""
    drive = Drive(BOX, tank__modes=1)
    drive.on(1.3, (0.3, 0.0, G))
    drive.on(0.1)
    action = drive.action
    rng = np.random.default_rng(4)
    for _ in range(150):
        drive.engine.set_fill('tank', 0.7 + 0.01 * rng.choice([-1.0, 1.0]))
        drive.on(0.02 * int(rng.integers(1, 20)))
    drive.engine.set_fill('tank', 0.7)
    drive.on(0.02)
    assert drive.action == pytest.approx(action, rel=0.05)

    still, moved = Drive(BOX, step=1e-9), Drive(BOX, step=1e-9)
    for one in (still, moved):
        one.step = 0.02
        one.on(1.3, (0.3, 0.1, G))
        one.count, one.step = round(one.count * 0.02 / 1e-9), 1e-9
    for fill in (0.3, 0.95, 0.7):
        moved.engine.set_fill('tank', fill)
        moved.one((0.3, 0.1, G))
        still.one((0.3, 0.1, G))
    (a,), (b,) = still.engine.tanks, moved.engine.tanks
    assert b.beta == pytest.approx(a.beta, rel=1e-6)
    assert b.beta_rate == pytest.approx(a.beta_rate, rel=1e-6)


def test_the_surface_stays_and_momentum_stays() -> None:
    drive = Drive(BOX, step=0.02)
    drive.on(0.9, (0.3, 0.2, G))
    (old,) = drive.engine.tanks
    beta, momentum = old.beta, old.coefficients.mu * old.beta_rate
    drive.count, drive.step = round(drive.count * 0.02 / 1e-9), 1e-9
    drive.engine.set_fill('tank', 0.2)
    drive.one((0.3, 0.2, G))
    (new,) = drive.engine.tanks
    assert new.beta == pytest.approx(beta, rel=1e-6, abs=1e-12)
    assert new.coefficients.mu * new.beta_rate == pytest.approx(momentum, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize('force', [(0.4, 0.2, G), REST])
def test_the_jump_of_the_wrench_goes_to_zero_with_the_step(force: tuple[float, ...]) -> None:
    jumps = []
    for step in (1e-2, 1e-3, 1e-4):
        pair = []
        for fill in (0.7, 0.7 + step):
            drive = Drive(BOX)
            drive.on(1.1, (0.4, 0.2, G))
            drive.on(0.5, force)
            drive.engine.set_fill('tank', fill)
            loads = drive.one(force)
            pair.append(np.concatenate([loads.wrench, loads.total]))
        jumps.append(np.abs(pair[1] - pair[0]).max() / np.abs(pair[0]).max())
    assert jumps[0] < 0.05
    for larger, smaller in itertools.pairwise(jumps):
        assert smaller == pytest.approx(larger / 10.0, rel=0.1)


def test_slow_draining_under_constant_force_goes_through_the_settled_liquids() -> None:
    """At every fill: the wrench of a liquid that has settled there, solved for by itself."""
    force = (0.5, 0.3, G)
    drive = Drive(BOX, tank__damping_ratio=0.2)
    drive.on(20.0, force)
    last = drive.one(force).total
    for k, fill in enumerate(np.linspace(0.7, 0.1, 181)[1:]):
        drive.engine.set_fill('tank', float(fill))
        loads = drive.on(0.3, force)
        assert np.abs(loads.total - last).max() < 0.04 * np.abs(loads.total).max()
        last = loads.total
        if k % 36 == 35:
            there = SloshEngine(
                SloshConfig.from_parameters(BOX | {'tank.fill_ratio': float(fill)})
            )
            expected = there.settled @ force
            assert loads.wrench == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
            rigid = there.rigid[:, :3] @ force
            assert loads.total == pytest.approx(
                expected + rigid, abs=2e-3 * np.abs(expected + rigid).max()
            )


# --- books ---------------------------------------------------------------------------------------


def test_the_books_keep_the_mass() -> None:
    drive = Drive(BOX)
    drive.on(0.1)
    rng = np.random.default_rng(2)
    came = went = 0.0
    last = 850.0 * VOLUME * 0.7
    for fill in [*rng.uniform(0.0, 1.0, 20).tolist(), 0.0, 1.0, 0.0, 0.3]:
        drive.engine.set_fill('tank', fill)
        assert drive.engine.mass == pytest.approx(last)  # the next sample brings it
        assert drive.engine.fill_ratio('tank') == pytest.approx(fill)
        drive.one()
        mass = 850.0 * VOLUME * fill
        came, went = came + max(mass - last, 0.0), went + max(last - mass, 0.0)
        last = mass
        assert drive.engine.mass == pytest.approx(mass)
        assert drive.engine.carried.mass == pytest.approx(mass)
    books = drive.engine.books['tank']
    assert (books.received, books.released) == pytest.approx((came, went))
    assert books.mass == pytest.approx(drive.engine.mass, abs=1e-9)
    assert books.first == pytest.approx(850.0 * VOLUME * 0.7)


def test_the_weight_is_that_of_the_liquid_that_is_there() -> None:
    drive = Drive(BOX)
    for fill in (0.7, 0.2, 0.0, 1.0):
        drive.engine.set_fill('tank', fill)
        loads = drive.one()
        assert loads.total[2] == pytest.approx(-850.0 * VOLUME * fill * G, abs=1e-9)


# --- ends ----------------------------------------------------------------------------------------


@pytest.mark.parametrize('end', [0.0, 1.0])
def test_no_wave_outlives_an_empty_or_full_tank(end: float) -> None:
    """What is filled in after that starts at rest: as in an engine that begins there."""
    drive = Drive(BOX)
    drive.on(1.0, (0.5, 0.2, G))
    drive.engine.set_fill('tank', end)
    loads = drive.on(0.1, (0.5, 0.2, G))
    assert not loads.wrench.any()
    assert loads.beta.size == 0
    assert (loads.elevation_max, loads.valid) == (0.0, True)
    drive.engine.set_fill('tank', 0.5)
    fresh = Drive(BOX | {'tank.fill_ratio': 0.5})
    fresh.one((0.5, 0.2, G))
    for _ in range(20):
        a, b = drive.one((0.5, 0.2, G)), fresh.one((0.5, 0.2, G))
        assert a.wrench == pytest.approx(b.wrench, rel=1e-6, abs=1e-6)
        assert a.total == pytest.approx(b.total, rel=1e-6, abs=1e-6)


def test_draining_to_the_last_drop_and_filling_to_the_brim_while_driving() -> None:
    drive = Drive(BOX)
    rng = np.random.default_rng(6)
    fills = [*np.linspace(0.7, 0.0, 40), *np.linspace(0.0, 1.0, 60), *np.linspace(1.0, 0.4, 20)]
    for fill in fills:
        drive.engine.set_fill('tank', float(fill))
        force = (*rng.normal(size=2).tolist(), G)
        loads = drive.one(force)
        for part in (loads.wrench, loads.total, loads.state, loads.pressure, loads.beta):
            assert np.isfinite(part).all()
        assert np.isfinite(loads.elevation_max)
        weight = 850.0 * VOLUME * fill * G
        assert loads.total[2] == pytest.approx(-weight, abs=1e-6)


# --- what is asked for ---------------------------------------------------------------------------


def test_the_same_fill_changes_nothing_at_all() -> None:
    one, other = Drive(BOX), Drive(BOX)
    for k in range(60):
        other.engine.set_fill('tank', 0.7)
        force = (np.sin(0.1 * k), 0.2, G)
        a, b = one.one(force), other.one(force)
        assert np.array_equal(a.total, b.total)
    assert other.engine.books['tank'].received == 0.0


@pytest.mark.parametrize('fill', [0.1, 0.3, 1.0 / 3.0, 0.55])
def test_a_fill_is_told_as_it_was_set(fill: float) -> None:
    """Without the rounding on its way through the depth: nobody takes it for another one."""
    drive = Drive({**BOX, 'tank.fill_ratio': 0.3})
    assert drive.engine.fill_ratio('tank') == 0.3
    drive.engine.set_fill('tank', fill)
    drive.one()
    assert drive.engine.fill_ratio('tank') == fill


def test_the_last_word_before_a_sample_counts() -> None:
    one, other = Drive(BOX), Drive(BOX)
    for drive, fills in ((one, [0.1, 0.9, 0.5]), (other, [0.5])):
        drive.on(0.2, (0.3, 0.0, G))
        for fill in fills:
            drive.engine.set_fill('tank', fill)
    assert np.array_equal(one.one().total, other.one().total)
    one.engine.set_fill('tank', 0.6)
    one.engine.set_fill('tank', 0.5)
    assert one.one().total == pytest.approx(other.one().total, rel=1e-9)


@pytest.mark.parametrize(
    ('tank', 'ratio', 'says'),
    [
        ('tank', 1.01, 'fill of tank is 1.01; it must be a ratio from 0 to 1'),
        ('tank', -1e-9, 'must be a ratio from 0 to 1'),
        ('tank', float('nan'), 'fill of tank is nan; it must be'),
        ('tank', float('inf'), 'is inf'),
        ('tank', True, 'is True'),
        ('tank', '0.5', "is '0.5'"),
        ('rear', 0.5, 'there is no tank rear; there is tank'),
    ],
)
def test_a_fill_that_is_none_is_refused(tank: str, ratio: float, says: str) -> None:
    drive = Drive(BOX)
    before = drive.one((0.1, 0.0, G)).total
    with pytest.raises(InputError, match=says):
        drive.engine.set_fill(tank, ratio)
    assert drive.engine.fill_ratio('tank') == 0.7
    assert drive.one((0.1, 0.0, G)).total[2] == before[2]


def test_a_fill_set_before_the_first_sample_is_where_it_begins() -> None:
    early, there = Drive(BOX), Drive(BOX | {'tank.fill_ratio': 0.4})
    early.engine.set_fill('tank', 0.4)
    for _ in range(10):
        a, b = early.one((0.5, 0.1, G)), there.one((0.5, 0.1, G))
        assert a.total == pytest.approx(b.total, rel=1e-12, abs=1e-9)


def test_a_fill_that_waits_outlives_another_mount() -> None:
    turned = Pose(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.ones(3))
    moved, there = Drive(BOX), Drive(BOX | {'tank.fill_ratio': 0.4})
    moved.on(0.2, (0.5, 0.1, G))
    moved.engine.set_fill('tank', 0.4)
    for drive in (moved, there):
        drive.engine.mount(turned)
    assert moved.engine.fill_ratio('tank') == pytest.approx(0.4)
    for _ in range(20):
        a, b = moved.one((0.5, 0.1, G)), there.one((0.5, 0.1, G))
        assert a.total == pytest.approx(b.total, rel=1e-12, abs=1e-9)


def test_each_of_two_tanks_has_its_own_fill() -> None:
    """The other one goes on as it was; the wrenches of both add up to that of the vehicle."""
    both = {k.replace('tank.', f'{n}.'): v for n in ('a', 'b') for k, v in BOX.items()}
    both |= {'tanks': ['a', 'b'], 'a.xyz': [1.0, 0.0, 0.0], 'b.xyz': [-2.0, 0.5, 0.3]}
    one, untouched = Drive(both), Drive(both)
    for fill in (0.7, 0.3, 0.0, 0.5):
        one.engine.set_fill('a', fill)
        for _ in range(15):
            force = (0.4, -0.2, G)
            loads = one.one(force)
            untouched.one(force)
            np.testing.assert_allclose(
                np.sum([tank.wrench for tank in one.engine.tanks], axis=0),
                loads.wrench,
                atol=1e-9,
            )
            (_, b), (_, c) = one.engine.tanks, untouched.engine.tanks
            assert b.beta == pytest.approx(c.beta, rel=1e-9, abs=1e-15)
    assert one.engine.books['b'].released == 0.0


# --- by table ------------------------------------------------------------------------------------


def test_a_pipe_is_filled_from_a_film_by_table() -> None:
    """Modes that the film did not have enter settled; points are dry, then wet, never NaN."""
    drive = Drive(PIPE)
    force = (0.05, 0.08, G)
    drive.on(8.0, force)
    assert drive.engine.tanks[0].coefficients.names == ('x1', 'x3')
    drive.engine.prepare_fills()
    fills = [0.02 * (1 + 1e-6), *np.geomspace(0.021, 0.98, 90).tolist(), 0.995, 1.0, 0.7]
    last = drive.one(force)
    weight = np.pi * 1.2**2 * 4.0 * 1000.0 * G
    for k, fill in enumerate(fills):
        drive.engine.set_fill('tank', fill)
        loads = drive.on(0.2 if k else 0.02, force)
        if k == 0:  # from the solution to the table, and one more mode
            assert np.abs(loads.total - last.total).max() < 2e-3 * np.abs(last.total).max()
        assert drive.engine.tanks[0].coefficients.names == (
            () if fill == 1.0 else ('x1', 'x3', 'y1')
        )
        assert np.isfinite(loads.total).all()
        assert np.isfinite(loads.pressure).all()
        high = loads.pressure[0]  # at z = 0.5 m
        surface = drive.engine.tanks[0].coefficients.liquid.surface_height
        assert (high == 0.0) == (surface < 0.5)
        assert loads.total[2] == pytest.approx(-weight * fill, rel=1e-9)
    assert drive.engine.books['tank'].mass == pytest.approx(drive.engine.mass, abs=1e-6)


def test_modes_that_come_with_more_liquid_are_settled_under_the_measured_gravity() -> None:
    """The surface that settled before leans by s_y/s_z; so does what the new sway mode adds."""
    drive = Drive(PIPE, model__gravity='measured', tank__damping_ratio=0.3)
    force = (0.0, 0.08, 1.6 * G)
    drive.on(8.0, force)
    drive.engine.set_fill('tank', 0.02 * (1 + 1e-6))
    loads = drive.one(force)
    (tank,) = drive.engine.tanks
    c = tank.coefficients
    sway = c.names.index('y1')
    slope = c.coupling[sway, 1] * force[1] / (c.mu[sway] * c.omega[sway] ** 2 * 1.6)
    assert abs(loads.beta[sway]) == pytest.approx(abs(slope), rel=1e-4)
    assert drive.on(2.0, force).beta[sway] == pytest.approx(loads.beta[sway], rel=1e-4)


def test_a_sphere_is_filled_and_drained() -> None:
    """From settled liquid to settled liquid, as solved for by itself at each fill."""
    force = (0.4, 0.3, G)
    drive = Drive(BALL)
    drive.on(10.0, force)
    for fill in (0.205, 0.5, 0.93, 0.995, 1.0, 0.0, 0.35):
        drive.engine.set_fill('tank', fill)
        loads = drive.on(10.0 if 0.01 < fill < 0.99 else 0.1, force)
        assert loads.total[2] == pytest.approx(-1000.0 * 4 / 3 * np.pi * 0.9**3 * fill * G)
        if 0.01 < fill < 0.99:
            there = SloshEngine(SloshConfig.from_parameters(BALL | {'tank.fill_ratio': fill}))
            expected = (there.settled + there.rigid[:, :3]) @ force
            np.testing.assert_allclose(
                loads.total, expected, rtol=0.0, atol=1e-4 * np.abs(expected).max()
            )


# --- before the table, and without one -----------------------------------------------------------


def test_sections_are_solved_for_at_all_fills_together() -> None:
    drive = Drive(PIPE | {'tank.fill_ratio': 0.5})
    assert drive.engine.fill_known('tank', 0.0)
    assert not drive.engine.fill_known('tank', 0.3)
    with pytest.raises(InputError, match='solved for at all fills together'):
        drive.engine.solve_fill('tank', 0.3)


def test_fills_that_cannot_be_tabulated_are_solved_for_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A vessel on two legs is two pools when it is all but empty: no table goes so far down."""
    trimesh = pytest.importorskip('trimesh')
    pytest.importorskip('manifold3d')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    few = VolumeResolution(cells=1.4, degree=3, triangles=800, grids=0)
    monkeypatch.setattr(volume_sweep, 'VolumeSweep', partial(VolumeSweep, resolution=few))
    monkeypatch.setattr(
        volume, 'volume_coefficients', partial(volume_coefficients, resolution=few)
    )
    monkeypatch.setattr(engine_fill, 'apart', engine_fill._here)
    gap = trimesh.creation.box((2.0, 0.5, 0.5)).apply_translation((0.0, 0.0, -0.5))
    trimesh.creation.box((1.0, 1.25, 1.5)).difference(gap).export(tmp_path / 'legs.ply')
    drive = Drive(
        {
            'tank.shape': 'mesh', 'tank.mesh_file': str(tmp_path / 'legs.ply'), 'tank.modes': 1,
            'tank.fill_ratio': 0.6, 'tank.damping_ratio': 0.05,
        }
    )  # fmt: skip
    with pytest.raises(InputError, match='2 pools that are not connected'):
        drive.engine.prepare_fills()
    drive.engine.set_fill('tank', 0.5)
    whole = 1.25 * 1.5 - 0.25
    assert drive.one().total[2] == pytest.approx(-1000.0 * whole * 0.5 * G)
    with pytest.raises(InputError, match='2 pools that are not connected'):
        drive.engine.set_fill('tank', 0.1)
    assert drive.engine.fill_ratio('tank') == 0.5
    assert drive.one().total[2] == pytest.approx(-1000.0 * whole * 0.5 * G)


# --- slosh modes --fill A:B:N --------------------------------------------------------------------

BOX_FILE = str(REPOSITORY / 'config' / 'rectangular_tank.yaml')


def modes(*arguments: str) -> str:
    run = CliRunner().invoke(app, ['modes', BOX_FILE, *arguments])
    if run.exception is not None:
        raise run.exception
    return run.output


def test_sweep_tells_each_fill_as_by_itself(tmp_path: Path) -> None:
    picture = tmp_path / 'sweep.png'
    rows = json.loads(modes('--fill', '0:1:5', '--json', '--plot', str(picture)))
    assert [row['fill_ratio'] for row in rows] == [0.0, 0.25, 0.5, 0.75, 1.0]
    for row in rows:
        alone = json.loads(modes('--fill', str(row['fill_ratio']), '--json'))
        assert {k: v for k, v in row.items() if k != 'fill_ratio'} == alone
    assert picture.stat().st_size > 20_000


def test_sweep_on_the_terminal_has_units_and_one_row_a_fill() -> None:
    told = modes('--fill', '0.2:0.8:4')
    for part in ('mass', '[kg]', '[rad/s]', 'J0 roll', '[kg m^2]', 'its height above O', '60.00'):
        assert part in told
    c = coefficients_of(rectangular(8.0, 2.0, 1.6), 0.96, 850.0, 8)
    assert f'{c.omega[0]:.4f}' in told
    assert f'{c.mass_moved[0]:.1f}' in told
    assert f'{c.lever[0]:+.4f}' in told


@pytest.mark.parametrize(
    ('fill', 'says'),
    [
        ('0.1:0.9', 'a sweep is A:B:N'),
        ('0.1:0.9:1', '2 to 1000'),
        ('0.1:0.9:x', 'a sweep is A:B:N'),
        ('0.1:1.9:3', '--fill is 1.9; it must be a ratio from 0 to 1'),
        ('half', '--fill is half; it must be a ratio'),
        ('nan', '--fill is nan'),
        ('0.001', '--fill is 0.001; it must be a ratio from 0.01 to 0.99, or 0, or 1'),
    ],
)
def test_a_sweep_that_is_none_is_refused(fill: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        modes('--fill', fill)


def test_a_section_with_a_shelf_has_no_table_and_is_filled_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Just above the shelf the liquid is a film on it: no table goes over that."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    shelf = [0.0, 0.0, 0.8, 0.0, 0.8, 0.9, 2.0, 0.9, 2.0, 1.5, 0.0, 1.5]
    drive = Drive(
        {
            'tank.shape': 'section_x', 'tank.points': shelf, 'tank.length': 3.0, 'tank.modes': 2,
            'tank.fill_ratio': 0.2, 'tank.damping_ratio': 0.05,
        }
    )  # fmt: skip
    with pytest.raises(InputError, match='too small to be computed'):
        drive.engine.prepare_fills()
    for fill in (0.3, 0.9):  # under the shelf and above
        drive.engine.solve_fill('tank', fill)
        assert drive.engine.set_fill('tank', fill)
        assert drive.one().total[2] == pytest.approx(-1000.0 * 3.0 * 1.92 * fill * G)
        found, tank = drive.engine.tanks[0].coefficients, section_x(shelf, 3.0)
        exact = coefficients_of(tank, tank.depth(fill), 1000.0, found.names)
        assert found.omega == pytest.approx(exact.omega, rel=1e-12)
