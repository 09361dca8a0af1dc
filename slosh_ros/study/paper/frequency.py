"""Figures 3 and 5: added mass over frequency, and the peaks read off it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.boundary_elements import BoundaryElements, Panels
from slosh_ros.hydro.frequency import (
    ComplexArray,
    rectangular_wall_ratio,
    total_added_mass,
)
from slosh_ros.study.paper import cases
from slosh_ros.study.paper.cases import Array
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.item import Drawing, Finding, Row, Verdict, against, claim
from slosh_ros.tank import UniformTank

_NODES = 24  # of Gauss, in each direction
_MODES = 60
_FINE = np.linspace(0.02, 5.0, 1200)  # [rad/s]
_AROUND = np.linspace(-0.2, 0.2, 25)  # of a natural frequency, where elements sweep finely
# by depth [m]; the paper: 470, 680, 1076, and not stated
_PANEL_SIZES = {0.8: 0.31, 1.2: 0.265, 1.8: 0.225, 1.125: 0.35}
_LITTLE = 5e-4  # an epsilon with which A_11 and A_15 come out about as printed
_NEAR = 0.02  # by which natural frequencies of so many panels may differ from the exact ones
_NO_CURVE = (
    "The paper's curve is in a picture, which the text does not hold: of the curve itself nothing "
    'can be compared.'
)


class _Elements(NamedTuple):
    """Boundary elements, their sweep damped by eq (36), and its part on the paper's grid."""

    solver: BoundaryElements
    fine: AddedMass
    grid: ComplexArray

    @property
    def panels(self) -> int:
        return len(self.solver.areas)


def peaks(omega: Array, values: ComplexArray) -> Array:
    """Frequencies at which a magnitude is higher than at both neighbours."""
    size = np.abs(values)
    inner = (size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])
    return np.asarray(omega[1:-1][inner])


def _peak_rows(
    key: str, of: str, printed: tuple[str, ...], found: Array, exact: tuple[float, ...]
) -> list[Row]:
    rows = []
    for k, (theirs, own) in enumerate(zip(printed, exact, strict=True)):
        steps = round(abs(float(theirs) - found[k]) / 0.1)
        rows.append(
            against(
                f'{key}_{k + 1}', f'peak {k + 1}, {of}', float(found[k]), theirs, 'rad/s',
                within=1e-6, head=True, evidence='largest |A| on the grid 0.05 + 0.1 n',
                why=f'the exact natural frequency is {own:.4f} rad/s; the peak is '
                + ('its neighbour on a grid of 0.1 rad/s' if steps == 0 else
                   f'{steps} step of the grid nearer to it than the printed one; not explained'),
            )
        )  # fmt: skip
    return rows


@cache
def solver(tank: UniformTank, depth: float, density: float) -> BoundaryElements:
    """Lay about as many boundary elements as the paper."""
    return BoundaryElements(Panels.of_tank(tank, depth, _PANEL_SIZES[depth]), density)


def _by_elements(
    tank: UniformTank, depth: float, density: float, exact: Sequence[float]
) -> _Elements | str:
    """Sweep by boundary elements, finely where they resonate; without them, what is missing."""
    try:
        elements = solver(tank, depth, density)
    except InputError as reason:
        return f'The curve of the boundary elements is left out: {reason}.'
    near = [place + _AROUND for place in exact]
    fine = elements.added_mass(np.unique([*cases.PAPER_GRID, *np.ravel(near)]), cases.EPSILON)
    return _Elements(elements, fine, fine.matrix[np.isin(fine.omega, cases.PAPER_GRID)])


def at_infinity(
    tank: UniformTank, depth: float, c: ModalCoefficients, epsilons: Sequence[float]
) -> tuple[int, Array]:
    """
    Give what panels and damping change in A_11, A_15, A_22 and A_24 of the modes at 50 rad/s.

    Parameters
    ----------
    tank : UniformTank
        A tank of the paper.
    depth : float
        Depth of the liquid [m].
    c : ModalCoefficients
        Its liquid.
    epsilons : sequence of float
        Dampings of eq (36).

    Returns
    -------
    count : int
        Number of panels.
    array, shape (n, 4)
        Relative differences from the exact ones, by damping [-].

    Raises
    ------
    InputError
        If `capytaine` is not installed.
    """
    elements = solver(tank, round(depth, 9), c.density)
    lever = c.mass * float(c.liquid.centroid[2])
    solid = np.array([c.mass, lever, c.mass, -lever])
    found = [
        elements.added_mass(cases.INFINITE, epsilon).matrix[0].real[[0, 0, 1, 1], [0, 4, 1, 3]]
        for epsilon in epsilons
    ]
    return len(elements.areas), (np.array(found) - solid) / cases.at_infinity(c) - 1.0


def by_panels(tank: UniformTank, depth: float, c: ModalCoefficients, part: int) -> str:
    """Tell what our own panels make of one of A_11, A_15, A_22, A_24 at 50 rad/s."""
    try:
        count, off = at_infinity(tank, depth, c, (0.0, _LITTLE))
    except InputError:
        return 'the mesh and the damping of the paper, most likely (see fig3)'
    return (
        f'our own {count} panels leave {off[0, part]:+.1%}, with eq (36) and epsilon = '
        f'{_LITTLE:g} {off[1, part]:+.1%}: mesh and damping of the paper, most likely (see fig3)'
    )


def _damping_row() -> Row:
    """Put the damping of eq (36) to the paper's infinite frequency."""
    bare, *damped = at_infinity(
        cases.TABLE_1_TANK, cases.TABLE_1_DEPTH, cases.table_1(), (0.0, _LITTLE, cases.EPSILON)
    )[1]
    little, much = ((1.0 + off[1]) / (1.0 + bare[1]) - 1.0 for off in damped)
    return claim(
        'damping_elements', 'A_15 of sloshing at 50 rad/s, changed by the damping of eq (36)',
        f'{little:+.1%} with epsilon = {_LITTLE:g}, {much:+.0%} with {cases.EPSILON:g}',
        '"negligible", epsilon not stated', abs(little) < 0.02 and abs(much) > 0.2,
        verdict=Verdict.OPEN, why='eq (36) grows with omega²: at 50 rad/s and 0.02 epsilon k_0 is '
        f'{cases.EPSILON * cases.INFINITE**2 / GRAVITY:.1f}/m, not small beside one over the '
        'depth. In Tables 1 and 2 A_15 is too small and A_11 too large by about what panels and '
        f'{_LITTLE:g} make of them', evidence='boundary elements with and without eq (36)',
    )  # fmt: skip


def _told(elements: _Elements | str) -> tuple[str, ...]:
    return () if isinstance(elements, _Elements) else (elements,)


def _element_rows(
    key: str, of: str, printed: tuple[str, ...], exact: tuple[float, ...],
    elements: _Elements, i: int,
) -> list[Row]:  # fmt: skip
    """Compare peaks of boundary elements with the printed ones, and their poles with the exact."""
    found = peaks(cases.PAPER_GRID, elements.grid[:, i, i])[: len(printed)]
    poles = [_pole(elements.solver, place, i) for place in found]
    off = [pole / own - 1.0 for pole, own in zip(poles, exact, strict=True)]
    return [
        claim(
            f'{key}_elements', f'peaks by our {elements.panels} boundary elements, {of}',
            ', '.join(f'{w:.2f}' for w in found), ', '.join(printed),
            [f'{w:.2f}' for w in found] == list(printed), unit='rad/s',
            why='these elements resonate at ' + ', '.join(f'{w:.3f}' for w in poles)
            + ' rad/s; a peak is the nearest point of the grid',
            evidence='the same sweep as the paper: constant panels, eq (36), eq (31)',
        ),
        claim(
            f'{key}_poles', f'natural frequencies by boundary elements against exact, {of}',
            ', '.join(f'{part:+.1%}' for part in off), '', max(np.abs(off)) < _NEAR,
            why='what panels of this size leave; it falls as their size',
            evidence='largest |A| between the points of the grid, against the modes',
        ),
    ]  # fmt: skip


def _pole(solver: BoundaryElements, place: float, i: int) -> float:
    """Frequency of the largest magnitude around a peak of the grid."""

    def depth(omega: float) -> float:
        return -float(np.abs(solver.added_mass(omega, cases.EPSILON).matrix[0, i, i]))

    return float(minimize_scalar(depth, bounds=(place - 0.06, place + 0.06), method='bounded').x)


def figure_3() -> Finding:
    """Draw the added mass of the rectangular tank, damped by eq (36)."""
    c, sweep = cases.table_1(), cases.table_1_sweep()
    ratio = rectangular_wall_ratio(cases.TABLE_1_TANK, cases.TABLE_1_DEPTH, c.names)
    fine = total_added_mass(c, _FINE, cases.EPSILON, ratio).real / 1e3
    grid = sweep.matrix
    exact_of = {n: float(c.omega[cases.mode(c, n)]) for n in ('x1', 'x3', 'x5', 'y1')}
    elements = _by_elements(
        cases.TABLE_1_TANK, cases.TABLE_1_DEPTH, cases.TABLE_1_DENSITY, list(exact_of.values())
    )
    columns: dict[str, Array] = {
        'omega [rad/s]': _FINE, 'A_11 [t]': fine[:, 0, 0], 'A_22 [t]': fine[:, 1, 1],
    }  # fmt: skip
    rows = []
    panels = []
    for i, printed, names in (
        (0, ('1.05', '2.95', '4.25'), ('x1', 'x3', 'x5')), (1, ('3.65',), ('y1',)),
    ):  # fmt: skip
        exact = tuple(exact_of[n] for n in names)
        found = peaks(cases.PAPER_GRID, grid[:, i, i])
        rows += _peak_rows(f'a{i + 1}{i + 1}', f'A_{i + 1}{i + 1}', printed, found, exact)
        curves = [
            Curve('250 modes', _FINE, fine[:, i, i]),
            Curve("modes, paper's grid", cases.PAPER_GRID, grid[:, i, i].real / 1e3, True),
        ]
        if isinstance(elements, _Elements):
            tag = f'A_{i + 1}{i + 1}'
            rows += _element_rows(tag.lower().replace('_', ''), tag, printed, exact,
                                  elements, i)  # fmt: skip
            rows += [_damping_row()] if i == 0 else []
            curve = elements.fine.matrix[:, i, i].real / 1e3
            curves.append(Curve(f'{elements.panels} elements', elements.fine.omega, curve))
            columns['omega of elements [rad/s]'] = elements.fine.omega
            columns[f'{tag} by elements [t]'] = curve
        panels.append(
            Panel(
                f'Re A_{i + 1}{i + 1} [t]',
                curves,
                marks={f'{w:.3f}': w for w in exact},
            )
        )
    return Finding(
        rows,
        text=(
            f'Modes and boundary elements are damped by eq (36), epsilon = {cases.EPSILON}; the '
            'paper does not state its own. It has 470 panels.',
            *_told(elements),
            _NO_CURVE,
        ),
        drawings=(
            Drawing(
                'fig3',
                'Figure 3: added mass of the rectangular tank (total, liquid mass included). '
                'Vertical lines: exact natural frequencies.',
                picture('Added mass, tank 8 m x 2 m x 0.8 m', 'frequency [rad/s]', panels),
                columns,
            ),
        ),
    )


def cylinder_wall_ratio(c: ModalCoefficients, tank: UniformTank, depth: float) -> Array:
    """
    Integral of phi^2 over the wetted walls over that of f^2 over the free surface, per mode.

    Parameters
    ----------
    c : ModalCoefficients
        Of the liquid in it, with potentials.
    tank : UniformTank
        A horizontal cylinder.
    depth : float
        Depth of the liquid [m].

    Returns
    -------
    array, shape (n,)
        [-]; see :func:`slosh_ros.hydro.frequency.rectangular_wall_ratio`.
    """
    if c.potentials is None:
        raise TypeError('the wall ratio needs the potentials of the modes')
    radius, end = tank.height / 2.0, tank.length / 2.0
    reach = np.arccos(1.0 - depth / radius)  # from the lowest point to the contact line
    place, weight = np.polynomial.legendre.leggauss(_NODES)
    angle, part = np.meshgrid(reach * place, place, indexing='ij')
    y, z = radius * np.sin(angle), radius - depth - radius * np.cos(angle)
    shell = np.stack([end * part, y, z], axis=-1).reshape(-1, 3)
    # an end in level strips from the lowest point up: |y| is the half width of a strip
    head = np.stack([np.full_like(y, end), np.abs(y) * part, z], axis=-1).reshape(-1, 3)
    weights = np.outer(reach * weight, weight)
    square = weights.ravel() * radius * end @ c.potentials.modes(shell) ** 2
    # over -reach .. reach each strip comes twice: once for each end
    square += (weights * y**2).ravel() @ c.potentials.modes(head) ** 2
    return np.asarray(square / (c.mu * c.omega**2 / (c.density * GRAVITY)))


def figure_5() -> Finding:
    """Draw the added mass of the cylinder at two fills."""
    rows: list[Row] = []
    curves: dict[str, tuple[Array, Array]] = {}
    columns: dict[str, Array] = {'omega [rad/s]': _FINE}
    for fill, printed in ((1.0, ('1.65', '3.75')), (1.5, ('2.05', '4.15'))):
        c = cases.braked(fill, _MODES)
        ratio = cylinder_wall_ratio(c, cases.BRAKED_TANK, fill * 1.2)
        exact = tuple(float(c.omega[cases.mode(c, n)]) for n in ('x1', 'x3'))
        grid = total_added_mass(c, cases.PAPER_GRID, cases.EPSILON, ratio)
        found = peaks(cases.PAPER_GRID, grid[:, 0, 0])
        tag = f'fill_{fill:.1f}R'.replace('.', '_')
        rows += _peak_rows(tag, f'h = {fill:.1f} R', printed, found, exact)
        fine = total_added_mass(c, _FINE, cases.EPSILON, ratio).real / 1e3
        curves[f'h = {fill} R, modes'] = _FINE, fine
        elements = _by_elements(cases.BRAKED_TANK, round(fill * 1.2, 9), c.density, exact)
        if isinstance(elements, _Elements):
            rows += _element_rows(tag, f'h = {fill:.1f} R', printed, exact, elements, 0)
            curve = elements.fine.matrix.real / 1e3
            curves[f'h = {fill} R, {elements.panels} elements'] = elements.fine.omega, curve
            columns[f'omega of elements at {fill} R [rad/s]'] = elements.fine.omega
            for k, unit in ((0, 't'), (4, 't m')):
                columns[f'A_1{k + 1} at {fill} R by elements [{unit}]'] = curve[:, 0, k]
        columns[f'A_11 at {fill} R [t]'] = fine[:, 0, 0]
        columns[f'A_15 at {fill} R [t m]'] = fine[:, 0, 4]
    panels = [
        Panel(
            f'Re A_{i + 1}{k + 1} [{unit}]',
            [Curve(name, omega, matrix[:, i, k]) for name, (omega, matrix) in curves.items()],
        )
        for i, k, unit in ((0, 0, 't'), (0, 4, 't m'))
    ]  # fmt: skip
    return Finding(
        rows,
        text=(
            f'{_MODES} modes, and boundary elements, damped by eq (36) with epsilon = '
            f'{cases.EPSILON}. The paper has 680 and 1076 panels.',
            *_told(elements),
            _NO_CURVE,
        ),
        drawings=(
            Drawing(
                'fig5',
                'Figure 5: added mass of the horizontal cylinder R = 1.2 m, L = 5.75 m.',
                picture('Added mass of the horizontal cylinder', 'frequency [rad/s]', panels),
                columns,
            ),
        ),
    )
