"""Exactness of the modal integrator, against closed forms and an independent ODE solver."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slosh_ros.modal import ModalIntegrator
from slosh_ros.modal.integrator import _phi_functions

OMEGA = np.array([0.675, 1.65, 3.4, 9.0])
ZETA = np.array([0.0, 0.02, 0.3, 0.9])
ZERO = np.zeros(4)


def kicked(omega: np.ndarray = OMEGA, zeta: np.ndarray = ZETA) -> ModalIntegrator:
    """Modes at beta = 0 with unit velocity: a tank at rest that moved with -1 until now."""
    modes = ModalIntegrator(omega, zeta)
    zero = np.zeros(len(omega))
    modes.start(zero, zero - 1.0)
    modes.coast(1e-300, zero, zero)
    modes.start(zero, zero)
    modes._amplitude = np.ones(len(omega), dtype=complex)
    return modes


@pytest.mark.parametrize('step', [1e-3, 0.37, 11.0])
def test_free_decay_has_the_rate_zeta_omega_and_the_damped_frequency(step):
    modes = kicked()
    damped = OMEGA * np.sqrt(1 - ZETA**2)
    for k in range(1, 20):
        modes.advance(step, ZERO, ZERO)
        t = k * step
        envelope = np.exp(-ZETA * OMEGA * t)
        np.testing.assert_allclose(
            modes.beta, envelope * np.sin(damped * t) / damped, atol=1e-12, rtol=0
        )


def test_no_drift_over_a_million_radians():
    """The undamped energy stays what it is: no amplitude error grows with time."""
    modes = kicked()
    for _ in range(20_000):
        modes.advance(77.7, ZERO, ZERO)
    energy = modes.beta_rate[0] ** 2 + (OMEGA[0] * modes.beta[0]) ** 2
    assert energy == pytest.approx(1.0, abs=1e-11)


def test_splitting_an_interval_changes_nothing():
    rng = np.random.default_rng(1)
    one, ten = kicked(), kicked()
    force, carried = ZERO, ZERO
    for interval in rng.uniform(1e-4, 0.8, 50):
        new_force, new_carried = rng.normal(size=(2, 4))
        one.advance(interval, new_force, new_carried)
        for part in np.arange(1, 11) / 10:
            ten.advance(
                interval / 10,
                force + part * (new_force - force),
                carried + part * (new_carried - carried),
            )
        force, carried = new_force, new_carried
    np.testing.assert_allclose(ten.beta, one.beta, atol=1e-12, rtol=0)
    np.testing.assert_allclose(ten.beta_rate, one.beta_rate, atol=1e-12, rtol=0)


def test_piecewise_linear_input_is_solved_exactly():
    """Against adaptive Runge-Kutta of the second-order equation, its input differentiated."""
    rng = np.random.default_rng(2)
    times = np.cumsum([0.0, *rng.uniform(0.05, 0.6, 12)])
    force, carried = rng.normal(size=(2, len(times), 4))
    modes = ModalIntegrator(OMEGA, ZETA)
    modes.start(force[0], carried[0])
    y = np.zeros(8)
    for k in range(1, len(times)):
        interval = times[k] - times[k - 1]
        slope = (carried[k] - carried[k - 1]) / interval
        gain = (force[k] - force[k - 1]) / interval
        start, zero = force[k - 1], times[k - 1]

        def second_order(t, y, slope=slope, gain=gain, start=start, zero=zero):
            beta, rate = y[:4], y[4:]
            pull = start + gain * (t - zero) + slope
            return np.concatenate([rate, -2 * ZETA * OMEGA * rate - OMEGA**2 * beta - pull])

        y = solve_ivp(
            second_order, times[k - 1 : k + 1], y, method='DOP853', rtol=1e-12, atol=1e-13
        ).y[:, -1]
        modes.advance(interval, force[k], carried[k])
        np.testing.assert_allclose(modes.beta, y[:4], atol=1e-10, rtol=0)
        np.testing.assert_allclose(modes.beta_rate, y[4:], atol=1e-10, rtol=0)


def test_brake_ramp_response_is_the_closed_form():
    """THEORY 8: beta = -(lambda_1/mu)(a_0/t_r)[q(t) - q(t - t_r)], undamped."""
    omega, ramp, a = 1.65, 2.0, 0.981

    def q(u: float) -> float:
        return max(u, 0) / omega**2 - np.sin(omega * max(u, 0)) / omega**3

    modes = ModalIntegrator(np.array([omega]), np.zeros(1))
    modes.start(np.zeros(1), np.zeros(1))
    t = 0.0
    for interval in [0.5, 1.5, 0.3, 4.0, 0.01]:
        t += interval
        modes.advance(interval, np.array([a * min(t / ramp, 1.0)]), np.zeros(1))
        assert modes.beta[0] == pytest.approx(-a / ramp * (q(t) - q(t - ramp)), abs=1e-13)


def test_constant_carried_velocity_moves_nothing():
    """A tank that turns steadily, and did so when the liquid was at rest in it."""
    modes = ModalIntegrator(OMEGA, ZETA)
    modes.start(ZERO, ZERO + 3.0)
    for _ in range(10):
        modes.advance(0.2, ZERO, ZERO + 3.0)
    np.testing.assert_allclose(modes.beta, 0.0, atol=1e-14)
    np.testing.assert_allclose(modes.beta_rate, 0.0, atol=1e-14)


def test_coasting_is_the_free_motion_between_two_inputs():
    free, coasting = kicked(), kicked()
    for modes in (free, coasting):
        modes.advance(0.4, ZERO, ZERO)
    free.advance(1.7, ZERO, ZERO)
    coasting.coast(1.7, ZERO + 5.0, ZERO + 7.0)
    np.testing.assert_allclose(coasting.beta, free.beta, atol=1e-14)
    np.testing.assert_allclose(coasting.beta_rate, free.beta_rate, atol=1e-14)


def test_phi_functions_agree_across_the_switch_of_method():
    import mpmath

    mpmath.mp.dps = 40
    for size in (1e-9, 1e-3, 0.2, 0.2499999, 0.2500001, 0.3, 1.0, 30.0):
        for angle in (0.5 * np.pi, 0.75 * np.pi, 0.98 * np.pi):
            x = size * np.exp(1j * angle)
            exact = mpmath.mpc(x)
            phi_1 = complex((mpmath.exp(exact) - 1) / exact)
            phi_2 = complex((mpmath.exp(exact) - 1 - exact) / exact**2)
            # alone, and beside a large one, which takes the other branch
            for values in ([x], [x, 9.0j]):
                got = _phi_functions(np.array(values, dtype=complex))
                assert abs(got[0][0] - phi_1) < 4e-15 * abs(phi_1)
                assert abs(got[1][0] - phi_2) < 1e-14 * abs(phi_2)


def heaved(step: float, heave: float, frequency: float, duration: float) -> ModalIntegrator:
    """Undamped mode of 2 rad/s under g (1 + heave cos), each step under its mean gravity."""
    modes = kicked(np.array([2.0]), np.zeros(1))
    time = np.arange(0.0, duration + step / 2.0, step)
    gravity = 1.0 + heave * np.cos(frequency * time)
    for before, now in itertools.pairwise(gravity):
        modes.under((before + now) / 2.0)
        modes.advance(step, np.zeros(1), np.zeros(1))
    return modes


def test_heave_follows_mathieus_equation_with_second_order():
    solution = solve_ivp(
        lambda t, x: [x[1], -4.0 * (1.0 + 0.3 * np.cos(1.3 * t)) * x[0]],
        (0.0, 5.0), [0.0, 1.0], rtol=1e-11, atol=1e-12,
    )  # fmt: skip
    errors = [abs(heaved(h, 0.3, 1.3, 5.0).beta[0] - solution.y[0, -1]) for h in (0.02, 0.01)]
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_heave_at_twice_the_frequency_makes_waves_grow_as_floquet_has_it():
    # first tongue of Mathieu's equation: rate = heave omega / 4 to first order
    period, heave = np.pi, 0.1
    first, last = (
        np.hypot(2.0 * m.beta[0], m.beta_rate[0])
        for m in (heaved(0.005, heave, 4.0, n * period) for n in (6, 10))
    )
    assert np.log(last / first) / (4 * period) == pytest.approx(heave * 2.0 / 4.0, rel=0.05)
    off = heaved(0.005, heave, 3.0, 10 * period)
    assert np.hypot(2.0 * off.beta[0], off.beta_rate[0]) < 1.5


def test_other_gravity_is_other_frequencies_with_the_same_damping_ratio():
    heavy, scaled = kicked(), kicked(OMEGA * np.sqrt(1.7), ZETA)
    heavy.under(1.7)
    heavy._amplitude = scaled._amplitude.copy()
    for modes in (heavy, scaled):
        modes.advance(0.7, ZERO + 0.3, ZERO + 0.1)
    np.testing.assert_allclose(heavy.beta, scaled.beta, rtol=1e-13)
    before = heavy.beta, heavy.beta_rate
    heavy.under(0.4)
    np.testing.assert_allclose((heavy.beta, heavy.beta_rate), before, rtol=1e-12, atol=1e-14)
