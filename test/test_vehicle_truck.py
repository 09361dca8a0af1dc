"""The truck's matrices follow from its Lagrangian; its statics and its modes are as derived."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle import (
    CALIBRATED_DAMPING_RATIO,
    TABLE_4,
    CoupledSystem,
    LiquidModes,
    Truck,
    TruckParameters,
)

Array = NDArray[np.float64]

CORRECTED = TruckParameters.corrected()
CALIBRATED = TruckParameters.calibrated()
PRINTED = TruckParameters.paper_as_printed()


def coupled(parameters: TruckParameters, damping_ratio: float = 0.0) -> CoupledSystem:
    modes = replace(TABLE_4, damping_ratio=np.array([damping_ratio]))
    return CoupledSystem.of(Truck(parameters), modes, parameters.liquid_origin)


def lagrangian_matrices(p: TruckParameters) -> tuple[Array, Array, Array, Array]:
    """Derive M, C, K, and B for the inputs (z_w1 .. z_w4, z_w1' .. z_w4', a), by sympy."""
    sp = pytest.importorskip('sympy', reason='the derivation needs sympy')
    t, a = sp.symbols('t a')
    q = [sp.Function(name)(t) for name in ('z_t', 'th_t', 'z_s', 'th_s', 'beta')]
    z_t, th_t, z_s, th_s, beta = q
    road = [sp.Function(f'z_w{i}')(t) for i in range(1, 5)]
    surge = sp.Function('X')(t)

    def at(x: float, z: float) -> tuple[Any, Any]:
        """Place a point of the semitrailer, given relative to S, in the world; nose down > 0."""
        return (
            surge + x * sp.cos(th_s) + z * sp.sin(th_s),
            z_s - x * sp.sin(th_s) + z * sp.cos(th_s),
        )

    x_c, z_c = at(p.liquid_offset, p.liquid_height)
    x_o, _ = at(p.liquid_offset, p.liquid_height + p.surface_height)
    lambda_1, lambda_5 = TABLE_4.coupling[0, [0, 4]]
    mu, omega = TABLE_4.mu[0], TABLE_4.omega[0]
    kinetic = (
        p.tractor_mass * z_t.diff(t) ** 2
        + p.tractor_pitch_inertia * th_t.diff(t) ** 2
        + p.semitrailer_mass * z_s.diff(t) ** 2
        + p.liquid_mass * (x_c.diff(t) ** 2 + z_c.diff(t) ** 2)
        + (p.semitrailer_pitch_inertia + p.liquid_pitch_inertia) * th_s.diff(t) ** 2
        + mu * beta.diff(t) ** 2
    ) / 2 + beta.diff(t) * (lambda_1 * x_o.diff(t) + lambda_5 * th_s.diff(t))
    bodies = [
        z_t - p.l_w1 * th_t,
        z_t + p.l_w2 * th_t,
        z_s + p.l_w3 * th_s,
        z_s + p.l_w4 * th_s,
    ]
    hitch = z_t + p.l_bt * th_t - (z_s - p.l_bs * th_s)
    axles = [z - w for z, w in zip(bodies, road, strict=True)]
    # the springs carry the static weight, so only gravity's change with the tilt is left
    potential = (
        p.axle_stiffness * sum(d**2 for d in axles) / 2
        + p.hitch_stiffness * hitch**2 / 2
        + p.liquid_mass * GRAVITY * (z_c - z_s + p.liquid_offset * th_s)
        + mu * omega**2 * beta**2 / 2
        - GRAVITY * lambda_1 * th_s * beta
    )
    dissipation = (
        p.axle_damping * sum(d.diff(t) ** 2 for d in axles) / 2
        + p.hitch_damping * hitch.diff(t) ** 2 / 2
    )
    lagrangian = kinetic - potential
    rate = [x.diff(t) for x in q]
    residual = [
        (lagrangian.diff(v).diff(t) - lagrangian.diff(x) + dissipation.diff(v)).doit()
        for x, v in zip(q, rate, strict=True)
    ]
    plain = {surge.diff(t, 2): a, surge.diff(t): sp.Symbol('u')}  # higher derivatives first
    for order in (2, 1, 0):
        for x in [*q, *road]:
            plain[x.diff(t, order)] = sp.Symbol(f'{x.func}_{order}')
    flat = [r.subs(list(plain.items())) for r in residual]
    rest = [(s, 0) for s in set().union(*(f.free_symbols for f in flat))]

    def jacobian(by: list[Any]) -> Array:
        return np.array([[float(f.diff(x).subs(rest)) for x in by] for f in flat])

    return (
        jacobian([plain[x.diff(t, 2)] for x in q]),
        jacobian([plain[x.diff(t)] for x in q]),
        jacobian([plain[x] for x in q]),
        -jacobian([plain[w] for w in road] + [plain[w.diff(t)] for w in road] + [a]),
    )


@pytest.mark.parametrize('parameters', [CORRECTED, CALIBRATED], ids=['corrected', 'calibrated'])
def test_matrices_follow_from_the_lagrangian(parameters: TruckParameters) -> None:
    mass, damping, stiffness, forcing = lagrangian_matrices(parameters)
    system, truck = coupled(parameters), Truck(parameters)
    np.testing.assert_allclose(system.mass, mass, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(system.damping, damping, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(system.stiffness, stiffness, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(truck.road_stiffness, forcing[:4, :4], rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(truck.road_damping, forcing[:4, 4:8], rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(system.forcing[:, 4], forcing[:, 8], rtol=1e-12, atol=1e-6)


@pytest.mark.parametrize('parameters', [CORRECTED, CALIBRATED], ids=['corrected', 'calibrated'])
def test_matrices_are_symmetric_and_energy_is_positive(parameters: TruckParameters) -> None:
    system = coupled(parameters)
    for matrix in (system.mass, system.damping, system.stiffness):
        np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(system.mass)[0] > 0.0
    assert np.linalg.eigvalsh(system.stiffness)[0] > 0.0
    assert np.linalg.eigvalsh(system.damping)[0] > -1e-9


def test_stiffness_eigenvalues() -> None:
    eigenvalues = np.linalg.eigvalsh(coupled(CORRECTED).stiffness)
    np.testing.assert_allclose(eigenvalues, [6.74e4, 7.17e5, 1.12e6, 7.04e6, 1.64e7], rtol=2e-3)


@pytest.mark.parametrize(
    ('parameters', 'damping_ratio', 'modes'),
    [
        (
            CORRECTED,
            0.0,
            [
                (0.4776, 0.0030),
                (3.7847, 0.0224),
                (6.8343, 0.0675),
                (14.765, 0.143),
                (27.103, 0.259),
            ],
        ),
        (
            CALIBRATED,
            CALIBRATED_DAMPING_RATIO,
            [
                (0.4773, 0.0326),
                (3.6196, 0.0215),
                (7.1442, 0.0705),
                (14.763, 0.143),
                (27.101, 0.259),
            ],
        ),
    ],
    ids=['corrected', 'calibrated'],
)
def test_coupled_modes(
    parameters: TruckParameters, damping_ratio: float, modes: list[tuple[float, float]]
) -> None:
    poles = coupled(parameters, damping_ratio).poles()
    np.testing.assert_allclose(poles[:, 0], [m[0] for m in modes], rtol=1e-4)
    np.testing.assert_allclose(poles[:, 1], [m[1] for m in modes], atol=6e-4)


def test_liquid_moves_its_coupling_from_o_to_the_semitrailer() -> None:
    at_base = TABLE_4.coupling_at(CORRECTED.liquid_origin)[0]
    # lambda_5 about O, plus the moment of lambda_1 about S: even the sign changes
    np.testing.assert_allclose(at_base, [-85382.9, 0.0, 0.0, 0.0, -14256.0, 0.0], atol=0.5)


def test_vertical_offset_of_lateral_modes_enters_roll_with_the_opposite_sign() -> None:
    sway = LiquidModes(np.ones(1), np.ones(1), np.array([[0.0, 2.0, 0, 0, 0, 0]]), np.zeros(1))
    np.testing.assert_allclose(
        sway.coupling_at(np.array([3.0, 0.0, 5.0])), [[0.0, 2.0, 0.0, -10.0, 0.0, 6.0]]
    )


def test_axle_distances_are_the_sums_of_the_lengths() -> None:
    np.testing.assert_allclose(CORRECTED.wheel_offsets, [0.0, 5.2, 15.3, 16.61])


def test_static_axle_loads_of_a_solid_cargo() -> None:
    loads = Truck(CORRECTED).static_axle_loads
    np.testing.assert_allclose(loads / 1e3, [36.0, 94.5, 148.1, 104.6], atol=0.06)


@pytest.mark.parametrize('parameters', [CORRECTED, CALIBRATED], ids=['corrected', 'calibrated'])
def test_static_axle_loads_balance_force_and_moment(parameters: TruckParameters) -> None:
    p = replace(parameters, hitch_stiffness=1e13, axle_stiffness=1e9)  # so stiff that it is level
    masses = np.array([p.tractor_mass, p.semitrailer_mass, p.liquid_mass])
    base = -p.base_position[0]
    levers = np.array([p.l_w1, base, base - p.liquid_offset])
    loads = Truck(p).static_axle_loads
    assert loads.sum() == pytest.approx(masses.sum() * GRAVITY, rel=1e-6)
    assert loads @ p.wheel_offsets == pytest.approx(masses @ levers * GRAVITY, rel=1e-4)


def test_printed_equations_are_unstable() -> None:
    poles = coupled(PRINTED).poles()
    np.testing.assert_allclose(np.sort(poles[:, 1])[:2], [-0.54, -0.17], atol=5e-3)


def test_misplaced_stiffness_alone_makes_the_printed_equations_unstable() -> None:
    system = coupled(CORRECTED)
    damping = system.damping.copy()
    damping[3, 2] += (CORRECTED.axle_stiffness - CORRECTED.axle_damping) * CORRECTED.l_w3
    damping[3, 2] += CORRECTED.axle_damping * (CORRECTED.l_w3 - CORRECTED.l_w4)
    ratios = np.sort(replace(system, damping=damping).poles()[:, 1])
    np.testing.assert_allclose(ratios[:2], [-0.39, -0.044], atol=5e-3)


def test_truck_topples_when_it_carries_twice_its_liquid() -> None:
    def lowest(scale: float) -> float:
        p = replace(
            CORRECTED,
            liquid_mass=scale * CORRECTED.liquid_mass,
            liquid_pitch_inertia=scale * CORRECTED.liquid_pitch_inertia,
        )
        modes = replace(TABLE_4, mu=scale * TABLE_4.mu, coupling=scale * TABLE_4.coupling)
        system = CoupledSystem.of(Truck(p), modes, p.liquid_origin)
        return float(np.linalg.eigvalsh(system.stiffness)[0])

    assert lowest(2.00) > 0.0 > lowest(2.02)


def test_liquid_modes_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match='2 modes need mu'):
        LiquidModes(np.ones(2), np.ones(1), np.ones((2, 6)), np.zeros(2))
