"""Slips of the paper's equations, each with evidence that is computed here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.study.paper import cases
from slosh_ros.study.paper.cases import Array
from slosh_ros.study.paper.item import Finding, Row, Verdict, claim
from slosh_ros.study.paper.manoeuvres import braking_run
from slosh_ros.study.paper.truck import peak_readings
from slosh_ros.vehicle import TABLE_4, Bump, CoupledSystem, Truck, TruckParameters
from slosh_ros.vehicle.truck import THETA_S, THETA_T, Z_S

_SLIP = Verdict.MISPRINT
_BETA = 4  # place of the mode behind the four degrees of freedom of the truck


def sloshing() -> Finding:
    """Go through sections 2 to 4."""
    return Finding(
        [*_signs(), *_axes(), *_green(), _lighter()],
        text=(
            'Slips in tables and numbers stand with their items: table1 (the "3D effect"), '
            'three_modes (names of the modes, "closer"), table2 (2.05 against 2.10, unit), table3 '
            '(12.3, 13.61), table4 (0.5 R, 0.675), fig14 and fig15 (times of axle 2).',
            'Eq (2) means d(phi)/dy, as (4) has it, by d(phi)/dn. Slips of reference only: '
            '"Equation (25) shows that ... changing the mass" means (29); "off-diagonal terms '
            'A_ii" means A_ij; indices j, k, i and m are used for one another.',
        ),
    )


def _signs() -> list[Row]:
    """Find the signs of eqs (28) and (29) from a slow harmonic motion in the engine."""
    c = cases.only(cases.table_1(), 'x1')
    omega = 0.3
    time = np.arange(0.0, 80.0, 0.05)
    push = np.cos(omega * time)
    tank = {'shape': 'rectangular', 'length': 8.0, 'width': 2.0, 'height': 1.6, 'fill_depth': 0.8}
    run = cases.drive(tank, c, time, cases.level(time, push), damping=0.3)
    late = time > 40.0
    beta = -(omega**2) * run.beta[late, 0]
    gain = float(beta @ push[late] / (push[late] @ push[late]))
    force = float(run.slosh[late, 0] @ beta / (beta @ beta))
    printed_gain = omega**2 / (c.omega[0] ** 2 - omega**2) * -c.coupling[0, 0] / c.mu[0]
    return [
        claim(
            'eq_28', "eq (28): beta'' per acceleration at 0.3 rad/s",
            f'{gain:+.4f} (engine)', f'{printed_gain:+.4f}',
            abs(gain / printed_gain + 1.0) < 0.05, verdict=_SLIP, head=True,
            why="the sign: beta'' = -omega² beta turns it; with that of (29) it cancels, so that "
            '(32)-(35) are right', evidence='harmonic motion through the engine, damped by 30 %',
        ),
        claim(
            'eq_29', "eq (29): sloshing force per beta''", f'{force:+.0f} (engine)',
            f'{c.coupling[0, 0]:+.0f} (-Q with Q of eq (30))',
            abs(force / c.coupling[0, 0] + 1.0) < 0.02, unit='kg', verdict=_SLIP,
            why="F = -(M eta'' - Q beta''), as eq (15) has it", evidence='the same motion',
        ),
    ]  # fmt: skip


def _axes() -> list[Row]:
    """Look at axes and indices."""
    c = cases.table_1()
    lateral, long, yaw = (cases.mode(c, name) for name in ('y1', 'x1', 'x1y1'))
    x, y = c.surface_points.T
    area = 16.0 / len(x)
    trial = [float(c.density * area * np.sum(-axis * y)) for axis in (x, y)]
    return [
        claim(
            'axes', 'y is vertical in eqs (2), (4), horizontal in (10)-(14)',
            f'lambda_2 = {c.coupling[lateral, 1]:.0f} kg with y to the side; 0 with y up',
            '-5512 kg in Table 1', abs(c.coupling[lateral, 1] + 5512.0) < 1.0, verdict=_SLIP,
            why='x along, y to the side, z up is the only reading that gives Table 1',
            evidence='on the surface a vertical y is zero, and so is eq (12)',
        ),
        claim(
            'shape', 'trial shape of lateral sloshing, "f = -x/R"',
            f'lambda_2 of -y: {trial[1]:.0f} kg m', f'lambda_2 of -x: {trial[0]:.0f} kg m',
            abs(trial[0]) < 1e-9 * abs(trial[1]), verdict=_SLIP,
            why='-y/R is meant: -x is not moved by swaying', evidence='eq (12) on the surface',
        ),
        claim(
            'omega_5', '"Omega_5 is the lateral component of the Stokes-Joukowski potential"',
            f'lambda_5 of (1,0): {c.coupling[long, 4]:.0f}, of (0,1): '
            f'{c.coupling[lateral, 4]:.0f} kg m', 'lateral', c.coupling[lateral, 4] == 0.0,
            verdict=_SLIP, why='it is that of pitch: it moves the longitudinal mode only',
            evidence='closed form',
        ),
        claim(
            'lambda_6', 'lambda_6, used in eqs (9), (20), (28)',
            f'{c.coupling[yaw, 5]:.2f} kg m of mode (1,1)', 'not defined in (10)-(14)',
            abs(c.coupling[yaw, 5] - 7884.27) < 0.01, verdict=_SLIP,
            why='the same form as (13), (14), with Omega_6', evidence='closed form',
        ),
    ]  # fmt: skip


def _green() -> list[Row]:
    """Put the Green function of eqs (22), (24) into the conditions it has to meet."""
    big_k, k, depth, z0 = 1.3, 0.9, 0.8, -0.3  # any will do

    def usual(z: float) -> float:
        return float(np.cosh(k * (z + depth)) * np.cosh(k * (z0 + depth)))

    def images(sign: float, z: float) -> float:
        places = np.array([z - z0, z + sign * z0 + 2.0 * depth])
        return float(np.sum(1.0 / np.hypot(0.5, places)))

    step = 1e-4
    laplace = [
        (f(-0.2 + step) - 2.0 * f(-0.2) + f(-0.2 - step)) / step**2 / f(-0.2) - k**2
        for f in (lambda _: 1.0, usual)
    ]
    leak = [
        (images(sign, -depth + step) - images(sign, -depth - step)) / (2.0 * step)
        for sign in (-1.0, 1.0)
    ]
    # wave number by wave number, by 1/r = integral of exp(-k|z - z0|) J_0(kR) dk
    direct = (big_k + k) * (np.exp(k * z0) + np.exp(-k * (z0 + 2.0 * depth)))
    wave = (k + big_k) * np.exp(-k * depth) * np.cosh(k * (z0 + depth))
    surface = [direct - factor * wave for factor in (2.0 * big_k / np.pi, 2.0)]
    return [
        claim(
            'eq_22', 'eq (22): Laplacian of the integrand over itself [1/m²]',
            f'{laplace[1]:.0e} with the factors', f'{laplace[0]:.2f}; 0 is needed',
            abs(laplace[0]) > 0.5 and abs(laplace[1]) < 1e-4, verdict=_SLIP, head=True,
            why='cosh k(z+H) cosh k(z0+H) is missing, and "G" before (P,Q)',
            evidence='finite differences at one wave number',
        ),
        claim(
            'eq_22_factor', 'eq (22): K G - dG/dz on the free surface',
            f'{surface[1]:.0e} with 2', f'{surface[0]:.2f} with 2K/pi; 0 is needed',
            abs(surface[0]) > 0.1 and abs(surface[1]) < 1e-12, verdict=_SLIP,
            why='the factor of the integral is 2', evidence='one wave number, cosh factors put in',
        ),
        claim(
            'eq_24', "eq (24): flow through the bottom of 1/r + 1/r'",
            f'{leak[1]:.0e} with z + z0 + 2H', f'{leak[0]:.2f}; 0 is needed',
            abs(leak[0]) > 0.1 and abs(leak[1]) < 1e-6, verdict=_SLIP,
            why='the image lies as far below the bottom as the source above it',
            evidence='finite differences',
        ),
    ]  # fmt: skip


def _lighter() -> Row:
    """Show the vertical load while the liquid sloshes."""
    c, run = braking_run(1.0, 1)
    weight = c.mass * GRAVITY
    change = float(np.abs(run.total[:, 2] + weight).max() / weight)
    return claim(
        'lighter', 'a negative added mass "makes the tank lighter"; F_3 = 0, eq (17)',
        f'vertical load {-weight / 1e3:.2f} kN, changed by {change:.0e}', 'lighter; 0',
        change < 1e-12, verdict=_SLIP,
        why='a negative added mass is a force in phase with the motion, no loss of weight; (17) '
        'is the modal part only: the whole is -m (g + heave acceleration)',
        evidence='total load of the engine while braking',
    )  # fmt: skip


# --- eq (38) -----------------------------------------------------------------------------------


def _system(p: TruckParameters | None = None) -> CoupledSystem:
    parameters = TruckParameters.corrected() if p is None else p
    return CoupledSystem.of(Truck(parameters), TABLE_4, parameters.liquid_origin)


def _with(damping: Array | None = None, stiffness: Array | None = None) -> CoupledSystem:
    """Add terms to the mended system."""
    right = _system()
    zero = np.zeros_like(right.mass)
    return replace(
        right,
        damping=right.damping + (zero if damping is None else damping),
        stiffness=right.stiffness + (zero if stiffness is None else stiffness),
    )


def _entry(row: int, column: int, value: float) -> Array:
    matrix = np.zeros((5, 5))
    matrix[row, column] = value
    return matrix


def _poles(system: CoupledSystem) -> str:
    return ', '.join(f'{w:.4g}' for w in system.poles()[:, 0])


def _ratios(system: CoupledSystem) -> Array:
    """Negative damping ratios, the worst first."""
    ratio = np.sort(system.poles()[:, 1])
    return np.asarray(ratio[ratio < -1e-9])


def _lowest(system: CoupledSystem) -> float:
    return float(system.poles()[:, 1].min())


def _asymmetry(system: CoupledSystem) -> float:
    return float(np.abs(system.stiffness - system.stiffness.T).max())


def vehicle() -> Finding:
    """Go through section 5, eqs (38) and (39)."""
    p = TruckParameters.corrected()
    k, c = p.axle_stiffness, p.axle_damping
    right = _system()
    turned = _with(
        _entry(THETA_T, THETA_T, -2.0 * c * p.l_w1**2),
        _entry(THETA_T, THETA_T, -2.0 * k * p.l_w1**2),
    )
    mixed = _with(_entry(THETA_S, Z_S, (k - c) * p.l_w3 + c * (p.l_w3 - p.l_w4)))
    twice = _with(
        _entry(THETA_S, THETA_S, c * (p.l_w3**2 - p.l_w4**2)),
        _entry(THETA_S, Z_S, k * (p.l_w3 - p.l_w4))
        + _entry(THETA_S, THETA_S, k * (p.l_w3**2 - p.l_w4**2)),
    )
    slack = _with(stiffness=_entry(_BETA, _BETA, -right.stiffness[_BETA, _BETA]))
    printed = _system(TruckParameters.paper_as_printed())
    softest = float(np.linalg.eigvalsh(slack.stiffness)[0])
    rows = [
        claim(
            'm1', 'tractor pitch: -c_w l_w1², -k_w l_w1²; natural frequencies',
            f'{_poles(right)} with +', _poles(turned),
            turned.stiffness[1, 1] < 0.3 * right.stiffness[1, 1], unit='rad/s', verdict=_SLIP,
            why='springs on both sides of the mass centre stiffen it: K22 = '
            f'{turned.stiffness[1, 1]:.3g} instead of {right.stiffness[1, 1]:.3g} N m',
            evidence='eigenvalues of eq (38) with this slip alone', head=True,
        ),
        claim(
            'm2', 'semitrailer pitch, k_w l_w3 among dampings; lowest damping ratios',
            f'{_lowest(right):.3f} with c_w l_w4', _numbers(_ratios(mixed)),
            _ratios(mixed).size == 2, verdict=_SLIP,
            why='c_w l_w4 is meant: as printed the truck feeds itself', head=True,
            evidence='eigenvalues of eq (38) with this slip alone',
        ),
        claim(
            'm3', 'semitrailer pitch: l_w3 twice',
            f'K symmetric, slosh at {right.poles()[0, 0]:.3f} rad/s with l_w4',
            f'asymmetric by {_asymmetry(twice):.3g} N, {twice.poles()[0, 0]:.3f} rad/s',
            _asymmetry(twice) > 1e5 and _asymmetry(right) == 0.0, verdict=_SLIP,
            why='l_w3 and l_w4, as in the row of the heave, which is right',
            evidence='eigenvalues of eq (38) with this slip alone',
        ),
        claim(
            'm5', 'modal row: "omega²" without beta; lowest eigenvalue of K',
            f'{np.linalg.eigvalsh(right.stiffness)[0]:.3g}', f'{softest:.3g}',
            softest < 0.0, verdict=_SLIP, why='without its spring the liquid runs away',
            evidence='eigenvalues of K with this slip alone',
        ),
        _reference(),
        _coupling(),
        claim(
            'm8', 'I_s + I_l', f'{right.mass[THETA_S, THETA_S]:.0f} if I_l is about its centroid',
            f'{p.semitrailer_pitch_inertia + p.liquid_pitch_inertia:.0f} if about S',
            right.mass[THETA_S, THETA_S] > p.semitrailer_pitch_inertia + p.liquid_pitch_inertia,
            unit='kg m²', verdict=Verdict.OPEN,
            why='the text does not say about which point I_l is, nor its value',
            evidence='M_l (d_l² + l_l²) of the mended system',
        ),
        _gravity(),
        _brake_moment(),
        claim(
            'eq_38', 'eq (38) to the letter; lowest damping ratios',
            f'{_lowest(right):.3f}, mended', _numbers(_ratios(printed)),
            _ratios(printed).size > 0, verdict=_SLIP, head=True,
            why='all slips together: unstable; the figures cannot have been computed with it',
            evidence='eigenvalues of TruckParameters.paper_as_printed()',
        ),
        _case_distinction(),
    ]  # fmt: skip
    return Finding(
        rows,
        text=(
            'Eq (38) against the same model derived from its Lagrangian (a test derives it by '
            'computer algebra). Right as printed: the signs of gravity, of -M_l d_l a, '
            "+ M_l g l_l, + lambda_5 beta'' and - g lambda_1 beta, and all other terms of rows "
            '1 to 3.',
            'Slips of print only: lost subscripts in "c_bt l_bs z-dot" and '
            '"c_bt l_bs l_bt theta-dot"; dots on "k_bt l_bs l_bt theta_s", "k_w l_w1 z_w1" and '
            '"k_w l_w2 z_w2"; repeated text in the rows of theta_t, z_s and beta. Table 3, the '
            'fill of Table 4 and two times of axle 2: items table3, table4, fig14, fig15.',
        ),
    )


def _numbers(values: Array) -> str:
    return ' and '.join(f'{value:.3f}' for value in values)


def _reference() -> Row:
    """M6: lambda_5 about O with the motion of S."""
    p = TruckParameters.corrected()
    moved = float(TABLE_4.coupling_at(p.liquid_origin)[0, 4])
    readings = peak_readings()
    right, wrong = (
        ', '.join(f'{x:.1f}' for x in readings[name])
        for name in ('corrected, d_l = 0.65 m', 'lambda_5 about O used with the motion of S (M6)')
    )
    return claim(
        'm6', 'lambda_5 (about O) with the pitch about S',
        f'{moved:+.0f} kg m', f'{TABLE_4.coupling[0, 4]:+.0f} kg m', moved < 0.0, verdict=_SLIP,
        head=True, why='even the sign changes: lambda_5 + z_O lambda_1 belongs there. Largest '
        f'effect of all on the force (pit, flat, bump): {wrong} kN instead of {right} kN',
        evidence='kinematics; simulations of fig12',
    )  # fmt: skip


def _coupling() -> Row:
    """M7: heave and pitch couple if the liquid is not above S."""
    p = TruckParameters.calibrated()
    full = _system(p)
    coupling = full.mass[Z_S, THETA_S]
    both = _entry(Z_S, THETA_S, coupling) + _entry(THETA_S, Z_S, coupling)
    bare = replace(full, mass=full.mass - both)
    shift = float(np.abs(bare.poles()[:, 0] / full.poles()[:, 0] - 1.0).max())
    return claim(
        'm7', 'M_l l_l between heave and pitch', f'{coupling:.0f} kg m at l_l = 0.425 m',
        'missing, though M_l g l_l is there', shift > 1e-3, verdict=_SLIP,
        why=f'frequencies change by up to {shift:.1%}; nothing if l_l = 0',
        evidence='eigenvalues with and without',
    )  # fmt: skip


def _gravity() -> Row:
    """M9: a centroid above S tips over."""
    p = TruckParameters.corrected()
    tipping = p.liquid_mass * GRAVITY * p.liquid_height
    share = tipping / (_system().stiffness[THETA_S, THETA_S] + tipping)
    return claim(
        'm9', 'M_l g d_l in the pitch stiffness', f'{tipping:.3g} N m, {share:.1%} of it',
        'left out', share < 0.02, verdict=Verdict.REPRODUCED,
        why='of second order and small: leaving it out is fair; we keep it',
        evidence='matrices of the mended system',
    )  # fmt: skip


def _brake_moment() -> Row:
    """M13: moments of the brake forces at the road."""
    p = TruckParameters.corrected()
    kept = p.liquid_mass * p.liquid_height * 0.98
    road = (p.semitrailer_mass + p.liquid_mass) * 0.98 * p.base_height
    return claim(
        'm13', 'pitch moment of braking the semitrailer',
        f'{road / 1e3:.0f} kN m more from forces at the road (S {p.base_height} m high: assumed)',
        f'{kept / 1e3:.0f} kN m, -M_l d_l a', road > kept, verdict=Verdict.OPEN,
        why='declared by the paper ("neglecting the interaction in the longitudinal direction"); '
        'heights are not stated. The general truck of slosh simulate has them',
        evidence='masses of Tables 3 and 4',
    )  # fmt: skip


def _case_distinction() -> Row:
    """M17: the parabola of eq (39) beside the bump."""
    bump = Bump(0.2)
    slope, half_curvature = bump.coefficients
    before = -bump.start * (slope - half_curvature * bump.start)
    height = float(bump.elevation(np.zeros(1))[0])
    return claim(
        'm17', 'eq (39): road under axle 1 at the start', f'{height:.1f} m', f'{before:.1f} m',
        before < -1.0 and height == 0.0, verdict=_SLIP, head=True,
        why='eq (39) holds on the bump only, 0 <= u <= s; elsewhere the road is flat',
        evidence='eq (39), 10 m before the bump',
    )  # fmt: skip
