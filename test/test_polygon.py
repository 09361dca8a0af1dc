"""Sections that are any polygon: exact solutions, an independent solver, identities, refusals."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from section_elements import Elements, assert_same
from test_section_shapes import assert_alike, shares

from slosh_ros.constants import GRAVITY
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.hydro.section_triangles import TriangleResolution
from slosh_ros.modal.loads import LoadMatrices
from slosh_ros.tank import Polygon, UniformTank, cylinder_x, rectangular, section_x

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

SURGE, SWAY, _, ROLL, PITCH, YAW = range(6)
CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'modified_oval.yaml'
OVAL = SloshConfig.from_file(CONFIG).tanks[0].tank
FINE = TriangleResolution(degree=10, half_waves=0.8, corner=1e-9, loads=14, poles=3.0)

SLANTED = [0.0, 0.0, 2.0, -0.3, 2.4, 1.0, 1.1, 1.6, -0.3, 0.9]
STEPPED = [-1.0, -0.5, 0.0, -0.5, 0.0, -1.3, 1.0, -1.3, 1.4, 1.0, -1.3, 1.0]  # a sump
BRANCHED = [
    -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 0.2, 1.0, 0.2, -0.4, -0.3, -0.4, -0.3, 1.0, -1.0, 1.0,
]  # fmt: skip
BAFFLED = [
    -1.2, -0.8, -0.1, -0.8, -0.1, -0.2, 0.1, -0.2, 0.1, -0.8, 1.2, -0.8, 1.2, 0.8, -1.2, 0.8,
]  # fmt: skip
HEXAGON = [-0.5, 0.0, 0.5, 0.0, 0.9, 0.5, 0.5, 1.0, -0.5, 1.0, -0.9, 0.5]
TUB = [-0.5, 0.0, 0.5, 0.0, 0.9, 0.5, 0.9, 1.0, -0.9, 1.0, -0.9, 0.5]


def solved(
    points: list[float], fill_ratio: float, length: float = 3.0, modes: int = 12
) -> ModalCoefficients:
    tank = section_x(points, length)
    return section_coefficients(tank, tank.depth(fill_ratio), 850.0, modes)


def kappa(c: ModalCoefficients) -> Array:
    return c.omega**2 / GRAVITY


# --- exact solutions -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    'points',
    [
        [0.0, 0.0, 2.3, 0.0, 2.3, 1.6, 0.0, 1.6],
        [2.3, 0.0, 2.3, 1.6, 0.0, 1.6, 0.0, 0.0],  # begun elsewhere
        [0.0, 1.6, 2.3, 1.6, 2.3, 0.0, 0.0, 0.0, 0.0, 1.6],  # clockwise, closed
        [-7.0, 5.0, -4.7, 5.0, -4.7, 5.5, -4.7, 6.6, -7.0, 6.6],  # from elsewhere, a point between
        [0.0, 0.0, 2.3, 0.0, 2.3, 1.6, 0.0, 1.8],  # a slanting roof, which the liquid is below
    ],
    ids=['plain', 'rotated', 'clockwise', 'shifted', 'roof'],
)
def test_a_rectangle_agrees_with_its_closed_form(points: list[float]) -> None:
    exact = rectangular_coefficients(rectangular(8.0, 2.3, 1.6), 0.7, 850.0, 12)
    found = section_coefficients(section_x(points, 8.0), 0.7, 850.0, 12)
    assert_alike(found, exact, 1e-6)
    assert found.surface_shapes == pytest.approx(exact.surface_shapes, abs=1e-6)


def test_a_right_angled_channel_has_the_frequencies_of_kirchhoff() -> None:
    """
    Walls at 45 degrees: Lamb, Hydrodynamics, ch. IX.

    psi = y Z, kappa h = 1,
    psi = sinh(t y) sin(t Z) + sin(t y) sinh(t Z), tanh(t h) = tan(t h), kappa h = t h coth(t h),
    Z from the edge at the bottom, h deep.
    """
    h, length = 0.8, 0.01  # so short that waves along the tank are all higher
    c = section_coefficients(section_x([-1.0, 1.0, 0.0, 0.0, 1.0, 1.0], length), h, 850.0, 4)
    assert c.names == ('y1', 'y3', 'y5', 'y7')
    t = np.array([(n + 0.25) * np.pi for n in (1, 2, 3)])
    t = [brentq(lambda x: np.tan(x) - np.tanh(x), x - 0.1, x + 0.1) for x in t]
    assert kappa(c) * h == pytest.approx([1.0, *(x / np.tanh(x) for x in t)], rel=1e-8)
    # of the first: masses and moments in closed form
    assert c.coupling[0, SWAY] ** 2 / c.mu[0] == pytest.approx(2.0 / 3.0 * c.mass, rel=1e-8)
    assert c.coupling[0, ROLL] == pytest.approx(c.coupling[0, SWAY] * h / 2.0, rel=1e-8)

    # a corner above the liquid takes the section's symmetry away, but nothing of the waves'
    lean = section_x([-1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.3], length)
    whole = section_coefficients(lean, h, 850.0, 4)
    assert whole.names == c.names
    assert kappa(whole) == pytest.approx(kappa(c), rel=1e-8)


def test_polygons_of_more_and_more_corners_become_a_circle() -> None:
    """Between corners on the circle the wall is off by (pi/n)^2/2: the error falls as n^-2."""
    exact = section_coefficients(cylinder_x(1.0, 4.0), 1.2, 850.0, 4)
    errors = []
    for n in (32, 64, 256):
        angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
        corners = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        tank = section_x(corners.ravel().tolist(), 4.0)
        # the same level under the axis
        c = section_coefficients(tank, 0.2 + tank.height / 2.0, 850.0, 4)
        assert c.names == exact.names
        errors.append(np.abs(c.omega / exact.omega - 1.0).max())
    rates = np.log(np.divide(errors[:-1], errors[1:])) / np.log([2.0, 4.0])
    assert rates == pytest.approx([2.0, 2.0], abs=0.25)
    assert errors[-1] < 1e-4


# --- an independent solver -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ('points', 'fill_ratio'),
    [(SLANTED, 0.3), (SLANTED, 0.9), (STEPPED, 0.65), (BRANCHED, 0.6)],
    ids=['slanted', 'slanted and nearly full', 'sump', 'two free surfaces'],
)
def test_triangles_of_degree_four_agree(points: list[float], fill_ratio: float) -> None:
    """Scikit-fem, graded to every corner: all twelve modes, the inertia with its products."""
    tank = section_x(points, 3.0)
    depth = tank.depth(fill_ratio)
    outline = tank.section.liquid_outline(depth)
    elements = Elements(outline, 0.2, outline)
    assert_same(section_coefficients(tank, depth, 850.0, 12), elements, 3.0)


# --- convergence ---------------------------------------------------------------------------------


def assert_converged(coarse: ModalCoefficients, fine: ModalCoefficients, rel: float) -> None:
    assert coarse.names == fine.names
    assert coarse.omega == pytest.approx(fine.omega, rel=rel)
    assert coarse.mu == pytest.approx(fine.mu, rel=4.0 * rel)
    assert shares(coarse) == pytest.approx(shares(fine), abs=rel)
    scale = np.diag(fine.inertia_stokes_joukowski).min()
    assert coarse.inertia_stokes_joukowski == pytest.approx(
        fine.inertia_stokes_joukowski, abs=rel * scale
    )


@pytest.mark.parametrize('fill_ratio', [0.01, 0.25, 0.5, 0.75, 0.99])
def test_a_road_tanker_keeps_its_digits_on_a_finer_mesh(fill_ratio: float) -> None:
    depth = OVAL.depth(fill_ratio)
    coarse = section_coefficients(OVAL, depth, 740.0, 12)
    fine = section_coefficients(OVAL, depth, 740.0, 12, FINE)
    assert_converged(coarse, fine, 2e-6)
    assert coarse.wall_friction == pytest.approx(fine.wall_friction, rel=1e-3)


@pytest.mark.parametrize(
    ('points', 'fill_ratio'),
    [(STEPPED, 0.5), (BRANCHED, 0.6), (BAFFLED, 0.45), (BAFFLED, 0.362), (SLANTED, 0.99)],
    ids=['sump', 'branched', 'baffled', '12 mm above the baffle', 'slanted'],
)
def test_corners_that_jut_in_cost_no_digits(points: list[float], fill_ratio: float) -> None:
    tank = section_x(points, 5.0)
    depth = tank.depth(fill_ratio)
    coarse = section_coefficients(tank, depth, 850.0, 12)
    fine = section_coefficients(tank, depth, 850.0, 12, FINE)
    assert_converged(coarse, fine, 4e-6)
    # the velocity is infinite there, its square on the wall barely integrable
    assert coarse.wall_friction == pytest.approx(fine.wall_friction, rel=2e-2)


@pytest.mark.parametrize('points', [HEXAGON, TUB], ids=['hexagon', 'tub'])
def test_twelve_modes_keep_five_digits_just_above_a_corner(points: list[float]) -> None:
    """Mu as well, that is the highest wave, at the wall: no energy whose error is squared."""
    tank = section_x(points, 3.0)
    coarse, fine = (
        section_coefficients(tank, 0.5 + 1e-4, 850.0, 12, resolution)
        for resolution in (None, TriangleResolution(10, 0.8, 1e-12, 14))
    )
    assert_converged(coarse, fine, 1e-6)


def test_errors_fall_exponentially_with_the_degree() -> None:
    """Also at a corner of 270 degrees, where uniform triangles gain h^(4/3) only."""
    tank = section_x(STEPPED, 5.0)
    depth = tank.depth(0.5)
    finer = TriangleResolution(12, 0.8, 1e-10, 14, 3.0)
    exact = section_coefficients(tank, depth, 850.0, 4, finer).omega
    errors = [
        section_coefficients(tank, depth, 850.0, 4, TriangleResolution(p, 1.0, 1e-9, 14)).omega
        / exact
        - 1.0
        for p in (3, 5, 7, 9)
    ]
    assert np.min(errors) > -1e-9  # Rayleigh quotients
    largest = np.max(errors, axis=1)
    assert np.all(largest[:-1] / largest[1:] > 4.0)
    assert largest[-1] < 1e-6


# --- symmetry and frames -------------------------------------------------------------------------


@pytest.mark.parametrize('points', [SLANTED, STEPPED], ids=['slanted', 'sump'])
def test_a_mirrored_tank_has_mirrored_coefficients(points: list[float]) -> None:
    """Under y -> -y: lambda_1, lambda_5 stay and lambda_6 turns, or both with the sign of f."""
    image = (np.array(points).reshape(-1, 2) * [-1.0, 1.0]).ravel().tolist()
    c, m = solved(points, 0.6), solved(image, 0.6)
    assert m.names == c.names
    assert m.omega == pytest.approx(c.omega, rel=1e-6)
    assert m.mu == pytest.approx(c.mu, rel=1e-5)
    reflect = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    sign = np.sign(np.sum(shares(m) * shares(c) * reflect, axis=1, keepdims=True))
    assert shares(m) == pytest.approx(sign * reflect * shares(c), abs=1e-6)
    assert m.liquid.centroid == pytest.approx(c.liquid.centroid * [1.0, -1.0, 1.0], abs=1e-12)
    assert m.liquid.surface_centre == pytest.approx(
        c.liquid.surface_centre * [1.0, -1.0, 1.0], abs=1e-12
    )
    turned = np.outer([-1.0, 1.0, -1.0], [-1.0, 1.0, -1.0])
    for name in ('inertia_frozen', 'inertia_stokes_joukowski'):
        scale = np.diag(getattr(c, name)).min()
        assert getattr(m, name) == pytest.approx(getattr(c, name) * turned, abs=1e-6 * scale)
    assert c.inertia_stokes_joukowski[1, 2] != pytest.approx(0.0, abs=1.0)


def test_the_origin_of_the_points_does_not_matter() -> None:
    moved = (np.array(SLANTED).reshape(-1, 2) + np.array([100.0, -3.0])).ravel().tolist()
    c, m = solved(SLANTED, 0.6), solved(moved, 0.6)
    assert m.omega == pytest.approx(c.omega, rel=1e-9)
    assert m.liquid.surface_centre == pytest.approx(c.liquid.surface_centre, abs=1e-12)


def test_a_symmetric_section_couples_as_a_symmetric_section() -> None:
    """Exactly: no surge mode yaws, no product of inertia, O under the middle."""
    c = section_coefficients(OVAL, OVAL.depth(0.75), 740.0, 12)
    coupled = c.coupling != 0.0
    assert not np.any(coupled[:, [SURGE, PITCH]].any(axis=1) & coupled[:, YAW])
    assert c.inertia_stokes_joukowski[1, 2] == 0.0
    assert np.all(c.liquid.centroid[:2] == 0.0)
    assert np.all(c.liquid.surface_centre[:2] == 0.0)


@pytest.mark.parametrize('points', [SLANTED, BRANCHED], ids=['slanted', 'branched'])
def test_the_leftmost_crest_is_a_crest(points: list[float]) -> None:
    """The sign of a mode: f > 0 where |f| first exceeds a half, from (-x, -y)."""
    c = solved(points, 0.6)
    assert np.abs(c.surface_shapes).max(axis=0) == pytest.approx(np.ones(12), abs=0.05)
    aft = np.isclose(c.surface_points[:, 0], -1.5)
    y, f = c.surface_points[aft, 1], c.surface_shapes[aft]
    f = f[np.argsort(y)]
    for shape in f.T:
        assert shape[np.flatnonzero(np.abs(shape) > 0.55)[0]] > 0.0
    first_sway, first_surge = (c.names.index(name) for name in ('y1', 'x1'))
    assert c.coupling[first_sway, SWAY] < 0.0
    assert c.coupling[first_surge, SURGE] < 0.0


# --- identities ----------------------------------------------------------------------------------

ANY = pytest.mark.parametrize(
    ('points', 'fill_ratio'),
    [(SLANTED, 0.05), (SLANTED, 0.95), (BRANCHED, 0.6), (BAFFLED, 0.5)],
    ids=['little', 'much', 'branched', 'baffled'],
)


@ANY
def test_modes_carry_the_hydrostatic_moment_and_less_than_the_mass(
    points: list[float], fill_ratio: float
) -> None:
    """Sums of g lambda^2/(mu omega^2) rise to rho I (Parseval); those of lambda^2/mu to less."""
    for axis, length in ((SWAY, 0.01), (SURGE, 100.0)):
        few, many = (solved(points, fill_ratio, length, n) for n in (3, 12))
        whole = few.density * few.liquid.surface_inertia[axis, axis]
        first, last = (c.static_residual[axis, axis] / whole for c in (few, many))
        assert 0.0 < last < first
        assert last < 4e-3
        assert np.all(np.sum(shares(many) ** 2, axis=0) < 1.0)
    c = solved(points, fill_ratio)
    assert np.all(c.wall_friction > 0.0)
    assert np.linalg.eigvalsh(c.inertia_frozen - c.inertia_stokes_joukowski).min() > 0.0
    assert np.linalg.eigvalsh(c.inertia_stokes_joukowski).min() > 0.0


@ANY
def test_the_liquid_keeps_its_level_in_a_tank_that_is_tilted(
    points: list[float], fill_ratio: float
) -> None:
    """Moment of modes at rest and of the weight: that of the tilted section's true liquid."""
    tank = section_x(points, 3.0)
    c = section_coefficients(tank, tank.depth(fill_ratio), 850.0, 5)
    o = c.liquid.surface_centre[1:]
    loads = LoadMatrices.of(c, np.zeros(5))

    def true_moment(tilt: float) -> float:
        """Turn the section about O, fill it to the same area, and weigh it."""
        turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
        corners = (tank.section.corners - o) @ turn.T
        lift = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        tilted = UniformTank('tilted', Polygon.of(corners.ravel().tolist()), 3.0)
        liquid = tilted.filled(tilted.depth(fill_ratio))
        arm = lift[0] + liquid.surface_centre[1] + liquid.centroid[1]
        return -c.mass * GRAVITY * arm

    def linear_moment(tilt: float) -> float:
        specific = GRAVITY * np.array([0.0, np.sin(tilt), np.cos(tilt), 0.0, 0.0, 0.0])
        beta = -(c.coupling @ specific) / (c.mu * c.omega**2)
        at_rest = loads.stiffness @ beta + (loads.coupling + loads.rigid) @ specific
        return float(at_rest[3])

    assert linear_moment(0.0) == pytest.approx(true_moment(0.0), abs=1e-6 * c.mass)
    step = 1e-5
    slopes = [(f(step) - f(-step)) / (2.0 * step) for f in (linear_moment, true_moment)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)


def test_a_slice_moves_along_x_as_if_frozen() -> None:
    """Between ends close to each other nothing flows across: pitch and yaw, and their product."""
    c = solved(SLANTED, 0.9, 1e-3, 1)
    frozen = c.inertia_frozen[1:, 1:]
    assert abs(frozen[0, 1]) > 1e-2 * frozen[0, 0]
    assert c.inertia_stokes_joukowski[1:, 1:] == pytest.approx(frozen, rel=5e-3)


def test_modal_mass_is_the_integral_of_the_surface_shape() -> None:
    """Eqs (10)-(12) over both pieces: mu = rho/kappa int f^2 dS, and int f dS = 0."""
    c = solved(BRANCHED, 0.6, 3.0, 6)
    n = 33
    simpson = np.array([1.0, *[4.0, 2.0] * (n // 2)]) / 3.0
    simpson[-1] = 1.0 / 3.0
    pieces = c.surface_points.reshape(2, n * n, 2)
    areas = np.prod(np.ptp(pieces, axis=1), axis=1)
    weight = np.outer(areas, np.outer(simpson, simpson)).ravel() / (n - 1) ** 2
    f = c.surface_shapes
    assert 850.0 / kappa(c) * (weight @ f**2) == pytest.approx(c.mu, rel=1e-3)
    moments = 850.0 * (weight * f.T) @ c.surface_points
    assert moments == pytest.approx(c.coupling[:, :2], rel=5e-3, abs=0.1)
    assert weight @ f == pytest.approx(np.zeros(6), abs=1e-4 * areas.sum())


def test_a_leaning_tank_at_rest_weighs_on_its_side() -> None:
    """From the configuration to the wrench: the weight acts where the liquid is."""
    config = SloshConfig.from_parameters(
        {
            'tank.shape': 'section_x',
            'tank.points': STEPPED,
            'tank.length': 3.0,
            'tank.fill_ratio': 0.3,
            'frames.output': 'tank_link',
        }
    )
    engine = SloshEngine(config)
    verdict, loads = engine.feed(
        MotionSample.from_imu(1_000_000_000, [0.0, 0.0, GRAVITY], [0.0, 0.0, 0.0])
    )
    assert loads is not None, verdict
    liquid = engine.tanks[0].coefficients.liquid
    weight = 1000.0 * liquid.volume * GRAVITY
    y = liquid.surface_centre[1] + liquid.centroid[1]
    assert y > 0.1  # the sump is on the left
    assert loads.total == pytest.approx([0.0, 0.0, -weight, -weight * y, 0.0, 0.0], abs=1e-6)
    assert loads.wrench == pytest.approx(np.zeros(6), abs=1e-6)


def test_dimensions() -> None:
    """Twice the size: omega/sqrt(2), masses times 8, moments 16, inertias 32."""
    twice = (2.0 * np.array(STEPPED)).tolist()
    small, large = solved(STEPPED, 0.5, 3.0), solved(twice, 0.5, 6.0)
    assert large.names == small.names
    assert large.omega == pytest.approx(small.omega / np.sqrt(2.0))
    assert large.mu == pytest.approx(small.mu * 8.0)
    assert large.coupling == pytest.approx(
        small.coupling * np.repeat([8.0, 16.0], 3), abs=1e-6 * large.mass
    )


# --- moments of the liquid at rest ---------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', [0.05, 0.4, 0.7, 0.97])
def test_moments_by_strips(fill_ratio: float) -> None:
    """Widths of a convex polygon, level by level, by Gauss points between its corners."""
    polygon = section_x(SLANTED, 1.0).section
    depth = section_x(SLANTED, 1.0).depth(fill_ratio)
    bottom = -polygon.bounding_box[1] / 2.0
    corners = polygon.corners
    levels = np.unique(np.append(np.clip(corners[:, 1], None, bottom + depth), bottom + depth))
    x, weight = np.polynomial.legendre.leggauss(6)
    total = np.zeros(6)
    m = polygon.moments(depth)
    for low, high in pairwise(levels):
        for z, dz in zip(
            (low + high) / 2 + (high - low) / 2 * x, (high - low) / 2 * weight, strict=True
        ):
            y = sorted(
                a[0] + (b[0] - a[0]) * (z - a[1]) / (b[1] - a[1])
                for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
                if (a[1] > z) != (b[1] > z)
            )
            left, right = np.array(y) - m.surface_y
            z -= bottom + depth
            whole, first, second = (np.diff([left**n, right**n])[0] / n for n in (1, 2, 3))
            total += dz * np.array([whole, first, z * whole, second, z * first, z**2 * whole])
    found = [m.area, m.y, m.z, m.yy, m.yz, m.zz]
    assert found == pytest.approx(total, rel=1e-9, abs=1e-12)
    assert m.area / polygon.area == pytest.approx(fill_ratio, rel=1e-9)
    ((left, right),) = m.surface
    assert left == pytest.approx(-right)
    # the frozen liquid of a tank 2 m long, about O
    liquid = section_x(SLANTED, 2.0).filled(depth)
    area, y, z, yy, yz, zz = 2.0 * total
    xx = area / 3.0
    assert liquid.inertia == pytest.approx(
        np.array([[yy + zz, 0.0, 0.0], [0.0, xx + zz, -yz], [0.0, -yz, xx + yy]]), abs=1e-9
    )
    assert liquid.centroid == pytest.approx([0.0, y / area, z / area], abs=1e-9)


def test_two_free_surfaces_have_one_centre() -> None:
    m = section_x(BRANCHED, 1.0).section.moments(1.5)
    assert m.surface_y == pytest.approx((0.7 * -0.65 + 0.8 * 0.6) / 1.5)
    assert m.width == pytest.approx(1.5)
    assert sum(b**2 - a**2 for a, b in m.surface) == pytest.approx(0.0, abs=1e-12)
    assert [b - a for a, b in m.surface] == pytest.approx([0.7, 0.8])
    ((left, right),) = solved(BRANCHED, 0.6, 3.0, 1).surface_gaps
    assert right - left == pytest.approx(0.5)


@pytest.mark.parametrize('depth', [0.6, 1.3])
def test_the_nearest_point_of_the_liquid(depth: float) -> None:
    tank = section_x(STEPPED, 3.0)
    rng = np.random.default_rng(5)
    outline = tank.section.liquid_outline(depth)
    dense = np.concatenate(
        [
            a + np.linspace(0, 1, 2001)[:, None] * (b - a)
            for a, b in pairwise([*outline, outline[0]])
        ]
    )
    for point in rng.uniform(-2.0, 2.0, (40, 2)):
        nearest = tank.section.nearest(depth, point)
        if not np.array_equal(nearest, point):
            gap = np.hypot(*(dense - point).T).min()
            assert np.hypot(*(nearest - point)) == pytest.approx(gap, abs=2e-3)
        else:
            fine = section_x(STEPPED, 3.0).section.moments(depth)
            assert outline[:, 0].min() <= point[0] <= outline[:, 0].max()
            assert -depth <= point[1] <= 0.0
            assert fine.area > 0.0


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('points', 'message'),
    [
        ([0.0, 0.0, 1.0, 0.0, 1.0], 'has 5 numbers; it takes pairs'),
        ([], 'has 0 corners'),
        ([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 'has 2 corners'),
        ([0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0], r'cross or touch: from corner 1 \(0, 0\) to 2'),
        ([0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0], r'repeats corner 2 \(1, 0\) as corner 3'),
        ([0.0, 0.0, 1.0, 0.0, 2.0, 0.0], 'cross or touch'),  # flat
        ([0.0, 0.0, 2.0, 0.0, 2.0, 1.0, 1.0, 1.0, 1.5, 1.0, 0.0, 2.0], 'cross or touch'),  # back
        ([0.0, 0.0, 1.0, 0.0, 0.5, 0.0, 0.5, 1.0], 'cross or touch'),  # a corner on an edge
        (
            [-1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 2.0, 0.0, 1.0, -1.0, 2.0],
            'cross or touch',
        ),  # waist
    ],
)
def test_what_is_no_simple_polygon_is_refused(points: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Polygon.of(points)


def test_liquid_in_two_pools_is_refused_by_its_fill() -> None:
    with pytest.raises(InputError, match=r'filled to 20.00%.* 2 pools that are not connected'):
        solved(BAFFLED, 0.2)
    assert solved(BAFFLED, 0.5, modes=3).names  # over the baffle it is one
    tank = section_x(BAFFLED, 3.0)
    assert tank.fill_ratio(tank.depth(0.2)) == pytest.approx(0.2)
    with pytest.raises(InputError, match='not connected'):
        tank.nearest(tank.depth(0.2), np.zeros(3))


def test_a_level_at_a_corner_or_a_ledge_is_one_of_both_sides() -> None:
    """Exactly at the height of corners, nothing breaks and nothing jumps."""
    tank = section_x(STEPPED, 5.0)
    at = [section_coefficients(tank, 0.8 + step, 850.0, 3).omega for step in (-1e-6, 0.0)]
    assert at[1] == pytest.approx(at[0], rel=1e-4)
    ridge = section_x([0.0, 3.0, 1.0, 0.0, 2.0, 2.0, 3.0, 0.0, 4.0, 3.0], 5.0).section
    assert [len(ridge.pools(depth)) for depth in (1.9, 2.0, 2.1)] == [2, 2, 1]
    ceiling = section_x([0.0, 0.0, 3.0, 0.0, 3.0, 2.0, 2.0, 1.0, 1.0, 1.5, 0.0, 1.0], 5.0).section
    assert [len(ceiling.moments(depth).surface) for depth in (0.9, 1.2, 1.5, 1.8)] == [1, 2, 1, 1]
    wide = section_x([-1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 1.0], 5.0)
    c = section_coefficients(wide, 1.0, 850.0, 3)
    assert c.liquid.surface_inertia[1, 1] == pytest.approx(5.0 * 2.0**3 / 12.0)


def test_a_level_a_hair_from_a_corner_is_nearly_at_it() -> None:
    """Within 1e-7 heights the mesh had no end; what is smaller than it can be counts as none."""
    tank = section_x(HEXAGON, 3.0)
    at = section_coefficients(tank, 0.5, 850.0, 3).omega
    for step in (1e-3, 1e-6, 1e-7, 1e-9, -1e-3, -1e-6, -1e-9):
        hair = section_coefficients(tank, 0.5 + step, 850.0, 3).omega
        assert hair == pytest.approx(at, rel=10.0 * abs(step) + 1e-8)


def test_corners_too_close_to_each_other_are_refused_at_once() -> None:
    """Where three points are one to the triangulation, edges would be halved for ever."""
    close = [-1.0, 0.0, 1.0, 0.0, 1.0, 0.5, 1.0 + 1e-8, 0.5 + 1e-8, 1.0, 1.0, -1.0, 1.0]
    with pytest.raises(InputError, match=r'details as small as .* leave them out'):
        section_coefficients(section_x(close, 3.0), 0.8, 850.0, 3)


def test_a_pinhole_and_a_hair_are_refused() -> None:
    """A spire's tip that is just wetted, and details far below any tank's."""
    spire = [-1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.1, 1.0, 0.0, 2.0, -0.1, 1.0, -1.0, 1.0]
    tank = section_x(spire, 3.0)
    with pytest.raises(InputError, match=r'free surface only .* slightly different'):
        section_coefficients(tank, 2.0 - 1e-6, 850.0, 3)
    # a film of a tenth of a millimetre over a floor of two metres
    ledge = [-1.0, -0.5, 1.0, -0.5, 1.0, 0.0, 3.0, 0.0, 3.0, 1.0, -1.0, 1.0]
    with pytest.raises(InputError, match=r'details as small as .* change the fill'):
        section_coefficients(section_x(ledge, 3.0), 0.5 + 1e-4, 850.0, 3)
