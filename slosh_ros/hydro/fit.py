"""
From added mass over frequency to poles, modal masses and levers (THEORY 5, item "fit").

What a family of modes makes of the added mass is in :mod:`slosh_ros.hydro.poles`; how their number
and places are found, in :mod:`slosh_ros.hydro.pole_search`. Here are the data and what is known of
the liquid at rest before, and the coefficients after. Poles above the band of the data take part
in the fit, not in the result.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.added_mass_checks import (
    check_damping,
    check_entries,
    check_reciprocity,
    check_symmetry,
)
from slosh_ros.hydro.coefficients import ModalCoefficients, surface_grid
from slosh_ros.hydro.pole_fit import FLOOR, PoleFit, Solved
from slosh_ros.hydro.pole_search import solve
from slosh_ros.hydro.poles import SURGE, SWAY, YAW, Family, PoleModel
from slosh_ros.tank import LiquidAtRest

Array = NDArray[np.float64]

__all__ = [
    'SURGE',
    'SWAY',
    'YAW',
    'Family',
    'FittedFamily',
    'added_mass_coefficients',
    'fit_family',
    'fit_liquid',
    'fitted_coefficients',
]

FEWEST = 8  # frequencies: two for each of the four numbers that make a mode
TRUST = 10.0  # weight of what is known of the liquid at rest: as a sweep of a hundred frequencies
DOUBT = 10.0  # standard errors of the data's own value at rest beyond which it is not used
SAME = 1e-6  # relative difference of entries of surge and sway that are the same
MASS_TOLERANCE = 0.05  # of A_11(0) against the liquid's mass
SURE = 5.0  # standard errors a mass must have: somewhere on a grid three come about by chance
NORMAL = 0.6745  # the median modulus of what is normally distributed, in standard deviations
COVERAGE = 10.0  # standard errors that errors reach: what lies above the band bends a fit, too


@dataclass(frozen=True, eq=False)
class FittedFamily:
    """
    Modes of one family within the band of the data, by rising frequency.

    Attributes
    ----------
    family : Family
        Which.
    omega : array, shape (n,)
        Natural frequencies [rad/s].
    modal_mass : array, shape (n,)
        R = lambda^2/mu, positive [kg], of yaw [kg m^2].
    lever : array, shape (n,)
        lambda_5/lambda_1 of surge, lambda_4/lambda_2 of sway [m]; zero for yaw, not a number where
        there is A_push alone.
    loss : array, shape (n,)
        Loss factor delta, twice the damping ratio at resonance.
    omega_error, modal_mass_error, lever_error : array, shape (n,)
        Standard errors, from the scatter of the data about the fit.
    constants : array, shape (3,)
        k_0 [kg], k_1 [kg m], k_2 [kg m^2] at rest: with the modes above the band at omega = 0.
    above_band : float
        Sum of g R/omega_m^2 over what lies above the band [kg m].
    at_rest : tuple of float
        A_push and A_cross at frequency 0, extrapolated from the data alone.
    noise : float
        Typical relative deviation of the data from the fit.
    """

    family: Family
    omega: Array
    modal_mass: Array
    lever: Array
    loss: Array
    omega_error: Array
    modal_mass_error: Array
    lever_error: Array
    constants: Array
    above_band: float
    at_rest: tuple[float, float]
    noise: float


def fit_family(
    data: AddedMass,
    family: Family,
    at_rest: tuple[float, float] | None = None,
    max_modes: int = 12,
) -> FittedFamily:
    """
    Fit the modes of one family.

    Parameters
    ----------
    data : AddedMass
        About O, radiation potential alone: see :meth:`AddedMass.about_surface_centre`. Where it
        has A_push alone, levers are not known; where it has no A_turn, two entries tell them.
    family : Family
        `SURGE`, `SWAY` or `YAW`.
    at_rest : tuple of float, optional
        A_push and A_cross at frequency 0 as known from the liquid at rest: m [kg], and
        m z_c + rho I_xx of surge or -(m z_c + rho I_yy) of sway [kg m]. It settles the lever of a
        low mode, of which g R/omega^2 leaves little to see in A_cross.
    max_modes : int
        Most modes to try, those above the band included.

    Raises
    ------
    InputError
        If entries are missing or there are too few frequencies.
    """
    problem = pole_problem(data, family)
    solved = solve(problem, max_modes)
    problem = replace(problem, settled=True)
    found = problem.at_rest(solved.modes, solved.constants)
    if at_rest is not None and problem.model.entries > 1:
        slopes = problem.at_rest_slopes(solved.modes)
        error = np.sqrt(np.diag(slopes @ problem.covariance(solved) @ slopes.T))
        known = np.asarray(at_rest, dtype=float)
        # panels make a liquid 1 % lighter at every frequency alike: such data have no use for its
        # true mass, which would tear their modes apart
        if np.all(np.abs(found - known) <= DOUBT * error + 1e-6 * np.abs(known)):
            # only now: far from the solution so much trust would draw poles to where they are not
            trust = np.median(solved.spread[:2], axis=1) / TRUST
            problem = replace(problem, known=np.array([known, trust]))
            solved = problem.refined(solved.modes, solved.constants, solved.spread)
    return _result(problem, family, solved, found)


def pole_problem(data: AddedMass, family: Family) -> PoleFit:
    """Real parts of the entries that a family has, and what they count against."""
    push, turn = family.push, family.turn
    finite = data.omega[np.isfinite(data.omega)]
    if len(finite) < FEWEST:
        raise InputError(
            f'{data.source}: {len(finite)} frequencies are too few for a fit; give '
            f'{FEWEST} or more'
        )
    band_end = _band_end(finite)
    entries = [(push, push)]
    if family is not YAW and not np.all(np.isnan(data.matrix[:, push, turn])):
        entries.append((push, turn))
        if data.has((turn, turn)):
            entries.append((turn, turn))
    if not data.has(*entries[:2]):
        raise InputError(
            f'{data.source}: a fit of {family.name} needs the entry {push + 1}{push + 1} at every '
            f'frequency, and {push + 1}{turn + 1} at every one or at none'
        )
    check_reciprocity(data, push, turn)
    # both triangles tell the same
    other = data.matrix.transpose(0, 2, 1)
    both = 0.5 * (data.matrix + np.where(np.isnan(other), data.matrix, other))
    values = np.stack([both[:, i, j] for i, j in entries])
    modulus = np.abs(values)
    order = np.arange(len(entries))[:, np.newaxis]
    # an entry may vanish, as that of roll about the axis of a cylinder: then it counts against
    # what a lever of the size of g/omega^2 would make of it
    median = np.median(modulus, axis=1, keepdims=True)
    level = np.maximum(median, median[0] * (GRAVITY / band_end**2) ** order)
    lossy = bool(np.any(np.abs(values.imag) > 1e-9 * modulus))
    if lossy:
        # losses change the shape of a mode, too: felt where lever and g/x nearly cancel
        with np.errstate(divide='ignore'):
            arm = np.where(data.omega > 0.0, GRAVITY / data.omega**2, 0.0)
        blur = np.abs(values[0].imag) * arm**order
        modulus = np.hypot(modulus, np.where(order > 0, blur, 0.0))
    return PoleFit(
        model=PoleModel(data.omega**2, len(entries), family.sign, lossy),
        values=values.real,
        modulus=modulus,
        level=np.maximum(level, np.finfo(float).tiny),
        band_end=band_end,
    )


def _result(problem: PoleFit, family: Family, solved: Solved, at_rest: Array) -> FittedFamily:
    """Keep what lies within the band and is sure."""
    count = len(solved.modes.omega)
    spread = np.sqrt(np.diag(problem.covariance(solved)))[: 4 * count].reshape(4, count)
    order = np.argsort(solved.modes.omega)
    sure = (solved.modes.omega <= problem.band_end) & (SURE * spread[1] < 1.0)
    kept, rest = order[sure[order]], solved.modes.take(~sure)
    modes, errors = solved.modes.take(kept), spread[:, kept]
    constants = np.zeros(3)
    constants[: len(solved.constants)] = solved.constants
    if family is not YAW:
        arm = GRAVITY / rest.omega**2
        constants[1] += family.sign * rest.hanging.sum()
        constants[2] += np.sum(rest.hanging * (2.0 * family.sign * rest.lever + arm))
    lever, unknown = modes.lever, 0.0 if family is YAW else np.nan
    if problem.model.entries == 1:
        lever = np.full_like(modes.omega, unknown)
    deviation = np.abs(solved.deviation * solved.spread)
    return FittedFamily(
        family=family,
        omega=modes.omega,
        modal_mass=modes.mass,
        lever=lever,
        loss=modes.loss if problem.model.lossy else np.zeros_like(modes.omega),
        omega_error=modes.omega * errors[0],
        modal_mass_error=modes.mass * errors[1],
        lever_error=errors[2],
        constants=constants,
        above_band=float(rest.hanging.sum()),
        at_rest=(float(at_rest[0]), float(at_rest[1]) if len(at_rest) > 1 else unknown),
        noise=float(np.median(deviation / np.hypot(FLOOR * problem.level, problem.modulus)))
        / NORMAL,
    )


def _band_end(omega: Array) -> float:
    """Last frequency before the grid breaks off; a row far above stands for infinity."""
    steps = np.diff(omega)
    breaks = np.flatnonzero(steps > 5.0 * np.median(steps))
    late = breaks[breaks >= len(omega) // 2]
    return float(omega[late[0]] if len(late) else omega[-1])


def added_mass_coefficients(
    data: AddedMass,
    liquid: LiquidAtRest,
    modes: int,
    plan: tuple[float, float] | None = None,
) -> ModalCoefficients:
    """
    Coefficients of a tank from its added mass: :func:`fit_liquid` and :func:`fitted_coefficients`.

    Parameters
    ----------
    data : AddedMass
        With the entries 11, 22, 15, 24, 44, 55, 66.
    liquid : LiquidAtRest
        The liquid; its mass, centroid and surface moments must fit the data.
    modes : int
        Most modes to keep, from the lowest frequency.
    plan : tuple of float, optional
        Length (x) and width (y) of the mean free surface [m].

    Raises
    ------
    InputError
        See :func:`fit_liquid`.
    """
    return fitted_coefficients(data, liquid, fit_liquid(data, liquid), modes, plan)


def fit_liquid(data: AddedMass, liquid: LiquidAtRest) -> tuple[FittedFamily, ...]:
    """
    Fit surge, sway and, unless it turns about a vertical axis of symmetry, yaw of a known liquid.

    Parameters
    ----------
    data : AddedMass
        With the entries 11, 22, 15, 24, 44, 55, 66.
    liquid : LiquidAtRest
        The liquid; its mass, centroid and surface moments must fit the data.

    Raises
    ------
    InputError
        If entries are missing, the matrix is not symmetric, the tank is not symmetric fore and aft
        and to both sides about O, radiation makes energy, or mass or moments at rest are not those
        of the liquid.
    """
    check_entries(data)
    about_o = data.about_surface_centre(liquid.surface_inertia)
    check_symmetry(about_o)
    check_damping(about_o)
    mass = data.density * liquid.volume
    lever = mass * float(liquid.centroid[2])
    i_xx, i_yy = data.density * np.diag(liquid.surface_inertia)
    families = [_checked(about_o, SURGE, (mass, lever + i_xx), i_xx)]
    if _round(about_o):
        families.append(_turned(families[0]))
    else:
        families.append(_checked(about_o, SWAY, (mass, -(lever + i_yy)), i_yy))
    # a vertical axis of symmetry leaves rounding in 66
    if np.abs(about_o.matrix[:, 5, 5]).max() > 1e-6 * np.abs(about_o.matrix[:, 4, 4]).max():
        families.append(fit_family(about_o, YAW))
    if not any(len(fitted.omega) for fitted in families):
        raise InputError(f'{data.source}: there is no sloshing mode within its frequencies')
    return tuple(families)


def fitted_coefficients(
    data: AddedMass,
    liquid: LiquidAtRest,
    families: tuple[FittedFamily, ...],
    modes: int,
    plan: tuple[float, float] | None = None,
) -> ModalCoefficients:
    """
    Coefficients of what :func:`fit_liquid` has found.

    The scale of a mode is free: here mu = R and lambda_1 = -R (lambda_2 of sway), so that beta is
    minus the displacement of the slosh mass; of yaw mu = R/m^2 and lambda_6 = -R/m.

    Parameters
    ----------
    data : AddedMass
        What was fitted.
    liquid : LiquidAtRest
        The liquid.
    families : tuple of FittedFamily
        Surge, sway and perhaps yaw.
    modes : int
        Most modes to keep, from the lowest frequency.
    plan : tuple of float, optional
        Length (x) and width (y) of the mean free surface [m]. With it, the elevation is that of
        the plane with the same first moment as the mode, lambda x/(rho I_xx): for a cosine its
        edge is 22 % too high. Without it there is none.
    """
    i_xx, i_yy = data.density * np.diag(liquid.surface_inertia)
    names: list[str] = []
    rows: list[Array] = []
    errors: list[float] = []
    for fitted in families:
        family = fitted.family
        for n, (omega, weight, arm) in enumerate(
            zip(fitted.omega, fitted.modal_mass, fitted.lever, strict=True), start=1
        ):
            coupling = np.zeros(6)
            coupling[family.push] = -weight
            if family is not YAW:
                coupling[family.turn] = -weight * arm
            names.append(f'{family.name}{n}')
            rows.append(np.array([omega, weight, *coupling]))
            errors.append(
                max(
                    fitted.omega_error[n - 1] / omega,
                    fitted.modal_mass_error[n - 1] / weight,
                )
            )
    order = np.argsort([row[0] for row in rows])[:modes]
    table = np.array(rows)[order]
    inertia = [families[1].constants[2], families[0].constants[2]]
    inertia.append(families[2].constants[0] if len(families) > 2 else 0.0)
    points = np.zeros((0, 2)) if plan is None else surface_grid(*plan)
    return ModalCoefficients(
        route='added mass',
        density=data.density,
        liquid=liquid,
        names=tuple(names[j] for j in order),
        omega=table[:, 0],
        mu=table[:, 1],
        coupling=table[:, 2:],
        inertia_stokes_joukowski=np.diag(inertia),
        wall_friction=None,
        surface_points=points,
        surface_shapes=points @ (table[:, 2:4] / np.array([i_xx, i_yy])).T,
        error=COVERAGE * float(max(errors[j] for j in order)),
    )


def _round(data: AddedMass) -> bool:
    """Tell that sway is surge, as in a tank that turns about a vertical axis of symmetry."""
    m = data.matrix
    pairs = ((m[:, 1, 1], m[:, 0, 0]), (m[:, 1, 3], -m[:, 0, 4]), (m[:, 3, 1], -m[:, 4, 0]))
    return all(
        np.allclose(sway, surge, rtol=SAME, atol=0.0)
        for sway, surge in (*pairs, (m[:, 3, 3], m[:, 4, 4]))
    )


def _turned(surge: FittedFamily) -> FittedFamily:
    """Return sway of a tank whose sway is surge."""
    mass, moment = surge.at_rest
    return replace(
        surge,
        family=SWAY,
        lever=-surge.lever,
        constants=surge.constants * np.array([1.0, -1.0, 1.0]),
        at_rest=(mass, -moment),
    )


def _checked(
    data: AddedMass, family: Family, at_rest: tuple[float, float], surface: float
) -> FittedFamily:
    """Fit a family of a liquid that is known at rest."""
    row, column = family.push + 1, family.turn + 1
    fitted = fit_family(data, family, at_rest)
    mass, moment = fitted.at_rest
    if abs(mass - at_rest[0]) > MASS_TOLERANCE * at_rest[0]:
        raise InputError(
            f'{data.source}: its entry {row}{row} tends to {mass:.4g} kg at rest, but the '
            f'liquid has a mass of {at_rest[0]:.4g} kg; check density, length scale, units and '
            'whether periods are taken for frequencies'
        )
    if abs(moment - at_rest[1]) > MASS_TOLERANCE * (abs(at_rest[1]) + surface):
        raise InputError(
            f'{data.source}: its entry {row}{column} tends to {moment:.4g} kg m at rest, but '
            f'centroid and free surface of the liquid give {at_rest[1]:.4g} kg m; check '
            'added_mass_hydrostatic, the reference point of its moments, its axes (x forward, '
            'y left, z up), its angles (rad) and the surface'
        )
    return fitted
