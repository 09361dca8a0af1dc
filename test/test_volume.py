"""Coefficients of a liquid in any closed surface, by splines that its wall cuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from enclosed import Enclosed, turned
from numpy.typing import NDArray
from test_pressure import integrated, random_motion, wrench
from wetted import Surface, interval, wetted

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.volume import (
    VolumeResolution,
    full_volume_coefficients,
    volume_coefficients,
)
from slosh_ros.tank import Capsule, cylinder_x, cylinder_z, rectangular, sphere
from slosh_ros.tank.surface import LiquidSurface

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

BOX, PIPE, DRUM = (
    Enclosed.of(tank)
    for tank in (rectangular(8.0, 2.0, 1.6), cylinder_x(1.2, 5.75), cylinder_z(1.2, 2.0))
)
ROUGH = VolumeResolution(triangles=4000)
_CASES = {
    'box': (BOX, 0.8, 8), 'drum': (DRUM, 0.9, 6), 'shallow pipe': (PIPE, 0.2, 4),
    'pipe, half full': (PIPE, 1.2, 8), 'pipe, 3/4 deep': (PIPE, 1.8, 6),
}  # fmt: skip


class Solved:
    """A tank by the route of its shape, and by its surface."""

    def __init__(self, tank: Enclosed, depth: float, modes: int) -> None:
        self.tank, self.depth = tank, depth
        self.exact: ModalCoefficients = coefficients_of(tank.tank, depth, 850.0, modes + 2)
        self.found: ModalCoefficients = volume_coefficients(tank, depth, 850.0, modes, ROUGH)
        self.order = [self.exact.names.index(name) for name in self.found.names]


@pytest.fixture(scope='module', params=_CASES)
def solved(request: pytest.FixtureRequest) -> Solved:
    return Solved(*_CASES[request.param])


def shares(c: ModalCoefficients) -> Array:
    """lambda_k^2/mu over what of the frozen liquid it belongs to, shape (n, 6)."""
    whole = np.array([c.mass, c.mass, np.inf, *np.diag(c.inertia_frozen)])
    return np.asarray(c.coupling**2 / c.mu[:, np.newaxis] / whole)


# --- against other routes ------------------------------------------------------------------------


def test_the_same_modes_as_by_the_route_of_the_shape(solved: Solved) -> None:
    """Frequencies and shares to four digits; of small couplings, to 1 % of the liquid."""
    exact, found = solved.exact, solved.found
    assert found.omega == pytest.approx(exact.omega[solved.order], rel=1e-4)
    assert shares(found) == pytest.approx(shares(exact)[solved.order], rel=3e-4, abs=2e-6)


def test_the_slosh_masses_hang_where_they_do_by_the_route_of_the_shape(solved: Solved) -> None:
    """lambda_5/lambda_1 and lambda_4/lambda_2 [m], of the modes that move with surge and sway."""
    for push, turn in ((0, 4), (1, 3)):
        strong = shares(solved.found)[:, push] > 1e-3
        ours, exact = (
            c.coupling[:, turn] / np.where(c.coupling[:, push] == 0.0, 1.0, c.coupling[:, push])
            for c in (solved.found, solved.exact)
        )
        assert strong.any()
        assert ours[strong] == pytest.approx(exact[solved.order][strong], rel=5e-4)


def test_shapes_have_the_same_scale_and_sign(solved: Solved) -> None:
    """Largest |f| = 1, a crest towards -x, -y: mu and lambda themselves are the same."""
    exact, found = solved.exact, solved.found
    assert found.mu == pytest.approx(exact.mu[solved.order], rel=1e-2)
    strong = shares(found) > 1e-3
    assert found.coupling[strong] == pytest.approx(exact.coupling[solved.order][strong], rel=5e-3)
    sampled = np.abs(found.surface_shapes).max(axis=0)
    assert np.all((sampled > 0.97) & (sampled <= 1.0))


def test_inertia_under_a_closed_lid(solved: Solved) -> None:
    exact = solved.exact.inertia_stokes_joukowski
    found = solved.found.inertia_stokes_joukowski
    assert found == pytest.approx(exact, rel=1e-4, abs=3e-6 * exact.max())
    assert np.linalg.eigvalsh(solved.found.inertia_frozen - found).min() > 0.0


def test_friction_at_the_wall(solved: Solved) -> None:
    found, exact = solved.found.wall_friction, solved.exact.wall_friction
    assert found is not None
    assert exact is not None
    assert found == pytest.approx(exact[solved.order], rel=1e-2)


def test_error_is_an_honest_estimate(solved: Solved) -> None:
    """Two grids tell how far the finer is from the truth."""
    exact, found = solved.exact, solved.found
    assert found.error is not None
    assert found.error < 1e-3
    off = np.abs(found.omega / exact.omega[solved.order] - 1.0).max()
    share = np.abs(shares(found) - shares(exact)[solved.order])
    coupling = np.max(share / np.maximum(shares(exact)[solved.order], 0.01)) / 2.0
    assert max(off, coupling) < found.error + 2e-5


def test_a_film_feels_nothing_of_the_medium_around_it() -> None:
    """What fills the box outside stiffens a film by 1e-4 of kappa; its quotient by 1e-8."""
    depth, quick = 0.012, VolumeResolution(cells=1.2, triangles=500, grids=0)
    exact = coefficients_of(BOX.tank, depth, 850.0, 1)
    found = volume_coefficients(BOX, depth, 850.0, 1, quick)
    assert found.names == exact.names
    assert found.omega == pytest.approx(exact.omega, rel=1e-6)
    assert shares(found) == pytest.approx(shares(exact), rel=1e-5, abs=1e-7)
    assert np.diag(found.inertia_stokes_joukowski) == pytest.approx(
        np.diag(exact.inertia_stokes_joukowski), rel=2e-6
    )


# --- heads and spheres ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('fill', 'kappa_radius'), [(0.5, [1.560157, 5.275546]), (0.896, [2.686348, 6.957093])]
)
def test_sphere(fill: float, kappa_radius: list[float]) -> None:
    """Published kappa R of half full, 1.5602, and THEORY 4; the pivot is the centre."""
    tank = sphere(1.2)
    depth = tank.depth(fill)
    c = volume_coefficients(tank, depth, 850.0, 4, ROUGH)
    assert c.names == ('x1', 'y1', 'x3', 'y3')
    assert c.omega[::2] ** 2 / GRAVITY * 1.2 == pytest.approx(kappa_radius, rel=3e-4)
    assert c.omega[::2] == pytest.approx(c.omega[1::2], rel=1e-5)
    surge = c.coupling[::2]
    pivot = 1.2 - depth - GRAVITY / c.omega[::2] ** 2
    error = np.abs(surge[:, 4] - surge[:, 0] * pivot)
    assert np.all(error < 5e-4 * 1.2 * np.abs(surge[:, 0]))


def test_heads_between_shorter_and_longer_flat_ends() -> None:
    """Heads of ellipsoids make a pipe longer than its straight part, shorter than the whole."""
    tank = cylinder_x(1.2, 4.0, head_depth=0.6)
    assert isinstance(tank, Capsule)
    c = volume_coefficients(tank, 1.2, 850.0, 2, ROUGH)
    longer, shorter = (
        coefficients_of(cylinder_x(1.2, length), 1.2, 850.0, 2).omega[0] for length in (5.2, 4.0)
    )
    assert longer < c.omega[0] < shorter
    sway = c.names.index('y1')  # hangs from the axis still
    arm = -GRAVITY / c.omega[sway] ** 2
    assert c.coupling[sway, 3] == pytest.approx(-c.coupling[sway, 1] * arm, rel=2e-2)
    assert c.error is not None
    assert c.error < 1e-3


def test_full_tanks_turn_by_stokes_and_joukowski() -> None:
    """No modes; a sphere moves with its centre, a box as by its section."""
    ball, case = sphere(1.2), Enclosed.of(rectangular(3.0, 2.0, 1.6))
    for tank, whole in ((ball, ball), (case, case.tank)):
        c = full_volume_coefficients(tank, tank.height, 850.0, ROUGH)
        exact = coefficients_of(whole, tank.height, 850.0, 4)
        assert c.names == ()
        assert c.inertia_stokes_joukowski == pytest.approx(
            exact.inertia_stokes_joukowski, rel=1e-4, abs=1e-4 * c.inertia_frozen.max()
        )
        points = np.array([[0.0, 0.0, 0.0], [0.4, -0.3, -0.7], [-0.5, 0.2, -1.1]])
        assert c.potentials is not None
        assert exact.potentials is not None
        assert c.potentials.stokes_joukowski(points) == pytest.approx(
            exact.potentials.stokes_joukowski(points), abs=2e-3
        )


# --- identities ----------------------------------------------------------------------------------


def test_modes_add_up_to_the_surface_moments() -> None:
    """Parseval: sum of g lambda_1^2/(mu omega^2) = rho I_xx, from below, THEORY 2.2."""
    c = volume_coefficients(BOX, 0.8, 850.0, 12)
    left = np.diag(c.static_residual) / np.diag(850.0 * c.liquid.surface_inertia)
    for axis, letter in enumerate('xy'):
        # the mode of a half-waves has 96/(pi a)^4 of it
        alone = [name for name in c.names if name.startswith(letter) and 'y' not in name[1:]]
        a = np.array([float(name[1:]) for name in alone])
        assert len(a) == (6, 1)[axis]
        assert left[axis] == pytest.approx(1.0 - 96.0 / np.pi**4 * np.sum(a**-4.0), abs=2e-6)


@pytest.mark.parametrize('depth', [0.6, 1.2, 1.9])
def test_sway_of_a_pipe_hangs_from_its_axis(depth: float) -> None:
    """Pressure passes through the axis: lambda_4 = -lambda_2 (z_axis - g/omega^2), THEORY 4."""
    c = volume_coefficients(PIPE, depth, 850.0, 6, ROUGH)
    sway = [name.startswith('y') for name in c.names]
    push, turn = c.coupling[sway, 1], c.coupling[sway, 3]
    arm = 1.2 - depth - GRAVITY / c.omega[sway] ** 2
    assert len(push) > 0
    assert turn == pytest.approx(-push * arm, rel=2e-4)
    half_full = abs(depth - 1.2) < 1e-9
    if half_full:  # published 1.3557, THEORY 4
        assert c.omega[c.names.index('y1')] ** 2 / GRAVITY * 1.2 == pytest.approx(1.3557, abs=1e-4)


def test_a_body_of_revolution_gives_pairs_along_x_and_y() -> None:
    """Also if its triangles are not symmetric; and J_66 = 0, lambda_6 = 0."""
    exact = coefficients_of(DRUM.tank, 0.9, 850.0, 4)
    for tank in (DRUM, turned(DRUM, 0.1)):
        c = volume_coefficients(tank, 0.9, 850.0, 4, ROUGH)
        assert c.names == ('x1', 'y1', 'x3', 'y3')
        assert c.omega == pytest.approx(exact.omega, rel=3e-4)
        share = shares(c)
        assert np.abs(c.coupling[[0, 2], 1]).max() < 1e-4 * np.abs(c.coupling[:, 1]).max()
        assert share[:2] == pytest.approx(shares(exact)[:2], rel=1e-3, abs=1e-6)
        assert share[:, 5].max() < 1e-8
        assert abs(c.inertia_stokes_joukowski[2, 2]) < 1e-6 * c.inertia_frozen[2, 2]


# --- what the surface does not change ------------------------------------------------------------


def test_slivers_do_no_harm() -> None:
    """The same box in triangles of random shape, most of them bad."""
    rng = np.random.default_rng(7)

    def shattered(depth: float, size: float) -> LiquidSurface:
        surface = BOX.surface(depth, size)

        def split(triangles: Array) -> Array:
            for _ in range(2):
                weights = rng.dirichlet([0.2, 0.2, 0.2], len(triangles))
                inner = np.einsum('nk,nkd->nd', weights, triangles)
                around = (np.roll(triangles, -k, axis=1) for k in range(3))
                triangles = np.concatenate(
                    [np.stack([t[:, 0], t[:, 1], inner], axis=1) for t in around]
                )
            return triangles

        return LiquidSurface(split(surface.wall), split(surface.free))

    plain = volume_coefficients(BOX, 0.8, 850.0, 4)
    broken = volume_coefficients(replace(BOX, surface=shattered), 0.8, 850.0, 4)
    assert broken.omega == pytest.approx(plain.omega, rel=1e-5)
    assert shares(broken) == pytest.approx(shares(plain), rel=1e-4, abs=1e-7)
    assert broken.inertia_stokes_joukowski == pytest.approx(
        plain.inertia_stokes_joukowski, rel=1e-4, abs=1.0
    )


def test_turned_about_the_vertical_axis() -> None:
    """A tank that is not symmetric about x = 0 and y = 0: nothing but directions changes."""
    angle = 0.5
    exact = coefficients_of(BOX.tank, 0.8, 850.0, 4)
    c = volume_coefficients(turned(BOX, angle), 0.8, 850.0, 4)
    assert c.omega == pytest.approx(exact.omega, rel=1e-4)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for part in (np.s_[:, :2], np.s_[:, 3:5]):
        ours, theirs = (
            np.einsum('ni,nj->nij', k.coupling[part], k.coupling[part]) / k.mu[:, None, None]
            for k in (c, exact)
        )
        straight = np.einsum('ij,njk,lk->nil', turn, ours, turn)
        for axis in range(2):
            assert straight[:, axis, axis] == pytest.approx(
                theirs[:, axis, axis], rel=3e-4, abs=1e-5 * theirs.max()
            )
    straight = np.eye(3)
    straight[:2, :2] = turn
    assert straight @ c.inertia_stokes_joukowski @ straight.T == pytest.approx(
        exact.inertia_stokes_joukowski, rel=1e-4, abs=1.0
    )


def test_smooth_walls_are_extrapolated() -> None:
    """Some 1000 triangles give the three digits of many."""
    exact = coefficients_of(PIPE.tank, 1.2, 850.0, 4)
    coarse = volume_coefficients(PIPE, 1.2, 850.0, 4, VolumeResolution(triangles=1000))
    assert coarse.omega == pytest.approx(exact.omega, rel=1e-3)  # 1e-2 without


# --- potentials ----------------------------------------------------------------------------------


def test_potentials_have_the_integrals_that_are_reported(solved: Solved) -> None:
    """Eqs (10)-(12), Green's identity, the energy under a lid: by quadrature on the true wall."""
    c, kappa = solved.found, solved.found.omega**2 / GRAVITY
    assert c.potentials is not None
    wall, lid = wetted(solved.tank.tank, solved.depth)
    closed = wall + lid
    f = c.potentials.modes(lid.points)
    assert 850.0 / kappa * (lid.weights @ f**2) == pytest.approx(c.mu, rel=1e-4)
    push = 850.0 * (lid.weights * lid.points[:, :2].T) @ f
    assert pytest.approx(c.coupling[:, :2], abs=1e-4 * np.abs(push).max()) == push.T
    turn = np.cross(closed.points, closed.normals)
    turned = 850.0 / kappa * ((closed.weights * turn.T) @ c.potentials.modes(closed.points))
    assert pytest.approx(c.coupling[:, 3:], abs=2e-4 * np.abs(turned).max()) == turned.T

    rotation = c.potentials.stokes_joukowski(closed.points)
    inertia = 850.0 * (closed.weights * rotation.T) @ turn
    expected = c.inertia_stokes_joukowski
    assert inertia == pytest.approx(expected, rel=1e-4, abs=1e-4 * expected.max())
    mean = lid.weights @ c.potentials.stokes_joukowski(lid.points)
    assert np.abs(mean).max() < 1e-4 * np.abs(rotation).max() * lid.weights.sum()


def test_potentials_are_those_of_the_shape(solved: Solved) -> None:
    """On the wall and the lid, everywhere, signs and mirror images included."""
    wall, lid = wetted(solved.tank.tank, solved.depth)
    points = (wall + lid).points[::11]
    assert solved.found.potentials is not None
    assert solved.exact.potentials is not None
    ours, exact = solved.found.potentials, solved.exact.potentials
    modes = exact.modes(points)[:, solved.order]
    assert np.abs(ours.modes(points) - modes).max() < 5e-3
    rotation = exact.stokes_joukowski(points)
    error = np.abs(ours.stokes_joukowski(points) - rotation)
    assert error.max() < 2e-3 * np.abs(rotation).max()


def test_shapes_at_the_surface_points_are_the_potentials(solved: Solved) -> None:
    c = solved.found
    assert c.potentials is not None
    on_top = np.pad(c.surface_points, ((0, 0), (0, 1)))
    assert c.potentials.modes(on_top) == pytest.approx(c.surface_shapes, abs=1e-12)


# --- pressure and wrench -------------------------------------------------------------------------


def unbalanced(c: ModalCoefficients, wall: Surface, lid: Surface) -> tuple[float, float]:
    """
    By how much the wall's pressure in random 6-dof motion misses force and moment of THEORY 2.2.

    Modes that are not kept stand still against the acceleration; the pressure takes their
    hydrostatic moment under alpha into account, the wrench does not: that is added to it.
    """
    motion, undamped = random_motion(len(c.names)), np.zeros(len(c.names))
    found, expected = integrated(c, undamped, wall, motion), wrench(c, undamped, motion)
    assert c.potentials is not None
    arms = (lid.weights * lid.points[:, :2].T) @ c.potentials.stokes_joukowski(lid.points)
    kept = (c.coupling[:, :2].T * (GRAVITY / (c.mu * c.omega**2))) @ c.coupling[:, 3:]
    missing = (c.density * arms - kept) @ motion[2][3:]
    expected[3:5] += [missing[1], -missing[0]]
    force, moment = (
        float(np.abs(found[part] - expected[part]).max() / np.abs(expected[part]).max())
        for part in (slice(0, 3), slice(3, 6))
    )
    return force, moment


def test_wall_pressure_adds_up_to_force_and_moment(solved: Solved) -> None:
    """
    On the true wall, from which flat triangles, 4000 here, are some way off: nothing else is left.

    All motions of a rigid body are among the splines, and so the identity is exact on what they
    are integrated over, whatever the grid.
    """
    force, moment = unbalanced(solved.found, *wetted(solved.tank.tank, solved.depth, 60))
    assert force < 2e-6
    shallow = solved.depth < 0.1 * solved.tank.tank.height
    assert moment < (2e-4 if shallow else 2.5e-5)


def test_wall_pressure_of_a_box_turned_and_of_heads() -> None:
    """Of a surface that is not symmetric, and, with more triangles, on ellipsoids: to 1e-5."""
    angle = 0.5
    c = volume_coefficients(turned(BOX, angle), 0.8, 850.0, 2, ROUGH)
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    liquid = replace(
        c.liquid,
        inertia=turn @ c.liquid.inertia @ turn.T,
        surface_inertia=turn[:2, :2] @ c.liquid.surface_inertia @ turn[:2, :2].T,
    )
    c = replace(c, liquid=liquid)
    wall, lid = (
        Surface(s.points @ turn.T, s.normals @ turn.T, s.weights) for s in wetted(BOX.tank, 0.8)
    )
    assert max(unbalanced(c, wall, lid)) < 1e-5

    tank = cylinder_x(1.2, 4.0, head_depth=0.6)
    c = volume_coefficients(tank, 1.2, 850.0, 2, VolumeResolution(triangles=40000))
    assert max(unbalanced(c, *half_full_with_heads(1.2, 4.0, 0.6))) < 1e-5


def half_full_with_heads(radius: float, length: float, head: float) -> tuple[Surface, Surface]:
    """Wall and lid of a half full cylinder with ellipsoidal heads."""
    wall, lid = wetted(cylinder_x(radius, length), radius)
    round_wall = np.abs(wall.normals[:, 0]) < 0.5
    wall = Surface(*(part[round_wall] for part in wall))
    out, out_weight = interval(0.0, np.pi / 2.0)
    down, down_weight = interval(-np.pi / 2.0, np.pi / 2.0)
    sine, cosine = np.sin(out)[:, np.newaxis], np.cos(out)[:, np.newaxis]
    across = np.stack([0.0 * down, np.sin(down), -np.cos(down)], axis=-1)
    for side in (-1.0, 1.0):
        end = side * np.array([length / 2.0, 0.0, 0.0])
        x = side * head * np.array([1.0, 0.0, 0.0])
        points = end + sine[..., None] * x + radius * cosine[..., None] * across
        # the gradient of the ellipsoid's equation, and the area that goes with it
        normals = sine[..., None] * x / head**2 + cosine[..., None] * across / radius
        steep = np.linalg.norm(normals, axis=-1)
        area = head * radius**2 * cosine * steep * np.outer(out_weight, down_weight)
        wall += Surface(
            points.reshape(-1, 3), (normals / steep[..., None]).reshape(-1, 3), area.ravel()
        )
        # half an ellipse of the lid
        share, share_weight = interval(0.0, 1.0)
        y = radius * np.sin(down)
        points = np.stack(
            [
                end[0] + side * head * np.outer(share, np.cos(down)),
                np.broadcast_to(y, (len(share), len(y))),
                np.zeros((len(share), len(y))),
            ],
            axis=-1,
        )
        weights = np.outer(share_weight, head * radius * np.cos(down) ** 2 * down_weight)
        up = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
        lid += Surface(points.reshape(-1, 3), up.reshape(-1, 3), weights.ravel())
    return wall, lid


# --- bad surfaces --------------------------------------------------------------------------------


def test_surfaces_that_enclose_nothing_are_refused() -> None:
    def holed(depth: float, size: float) -> LiquidSurface:
        surface = BOX.surface(depth, size)
        return replace(surface, wall=surface.wall[2:])

    def inside_out(depth: float, size: float) -> LiquidSurface:
        surface = BOX.surface(depth, size)
        return LiquidSurface(surface.wall[:, ::-1], surface.free[:, ::-1])

    for bad, words in ((holed, 'not closed'), (inside_out, 'not turned outwards')):
        with pytest.raises(InputError, match=words):
            volume_coefficients(replace(BOX, surface=bad), 0.8, 850.0, 2)


def test_two_pools_are_refused() -> None:
    half = Enclosed.of(rectangular(2.0, 2.0, 1.6))

    def apart(depth: float, size: float) -> LiquidSurface:
        pool = half.surface(depth, size)
        aside = np.array([3.0, 0.0, 0.0])
        return LiquidSurface(
            np.concatenate([pool.wall - aside, pool.wall + aside]),
            np.concatenate([pool.free - aside, pool.free + aside]),
        )

    with pytest.raises(InputError, match='not one pool'):
        volume_coefficients(replace(BOX, surface=apart), 0.8, 850.0, 2)
