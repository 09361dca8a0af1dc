"""
Modal coefficients at any fill of a tank, interpolated from a few that are solved for.

The angle t with depth = height (1 - cos t)/2 takes the place of the fill: of round tanks the
coefficients are analytic in it, and in others the solutions are dense where it is wanted, towards
the bottom and the roof. Between the levels at which the wall has a corner, where the coefficients
have a kink, polynomials in t go through nodes that are chosen one by one where the last ones leave
most room (Leja). What the polynomial misses a new node by, before it goes through it, is the error
that is stated; where it does not become small, the interval is halved.

Interpolated are quantities that do not depend on how modes are scaled: log omega,
lambda/sqrt(mu m) with the mass m, f sqrt(sin t/mu)/omega, J0/m. The scale max|f| = 1 is found
afterwards, from the interpolated surface, as the solver finds it. A mode is known by its name:
index j is the same mode at every fill. Its sign goes on steadily, where the convention of the
solver would let it jump. Modes of the 3-D route are followed from fill to fill by their likeness.

A film, and a bubble under the roof, are beyond the solvers: from `FILL_RANGE` to the empty and
the full tank the modes fade away in proportion to the liquid or the air that is left. Mass,
centroid and frozen inertia are exact; of the sloshing no more is told than that it is so small.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import (
    Array,
    ModalCoefficients,
    Potentials,
    peaks,
    still_coefficients,
)
from slosh_ros.hydro.corner_levels import corner_levels
from slosh_ros.hydro.routes import coefficients_of
from slosh_ros.tank import LiquidAtRest, Tank

# Nearly empty and nearly full tanks leave both linear theory and the solvers' accuracy.
FILL_RANGE = (0.01, 0.99)
_ROUTE = 'fill table'
FADING = f'{_ROUTE}, fading'  # route of what is beyond
TOLERANCE = 5e-5  # [-] of what a new node is missed by
SWEPT_TOLERANCE = 1e-4  # the same, of solutions that are no better themselves
_HEIGHTS = 0.05  # weight of the error of heights at single points: they may miss by 1e-3
_SWEPT_HEIGHTS = 0.01  # the same, where a wall of triangles has highest points here or there
_SPARSE = 2  # of so many samples of the crests one is enough: they are dense at the ends, and
# at peaks there goes a parabola through three
_FIRST = 3  # nodes of an interval before the first is tested
_MOST = 16  # nodes of an interval; it is halved if they are not enough
_SOLUTIONS = 160  # after so many each interval gets no more than some nodes
_DEAR = 120  # of tanks of any shape, which take a second each
_ENOUGH = 5  # these nodes
_SHARP = 0.12  # [rad] a corner that turns the wall by less has no wave of its own
_CANDIDATES = 201  # places for a new node
_LEVEL = 1e-9  # [heights] what is above the surface by less is at it
_SAME_PLACE = 2e-3  # [m] by which a point may have been moved into the liquid


def angle_at(depth: float, height: float) -> float:
    """Angle t that takes the place of a depth of the liquid [m] in a tank of a height [m]."""
    return 2.0 * float(np.arctan2(np.sqrt(depth), np.sqrt(height - depth)))


def depth_at(angle: float, height: float) -> float:
    """Depth [m] that an angle t stands for."""
    return height * float(np.sin(angle / 2.0)) ** 2


@dataclass(frozen=True)
class Start:
    """
    Where which modes of a tank of any shape have their names.

    Attributes
    ----------
    modes : int
        How many modes: the lowest.
    depth : float
        At this depth [m].
    all_kinds : bool
        Whether the lowest modes of surge, of sway and of yaw are wanted in any case.
    """

    modes: int
    depth: float
    all_kinds: bool = True


@dataclass(frozen=True, eq=False)
class _Node:
    """
    A solved fill.

    Attributes
    ----------
    angle : float
        Place t [rad].
    sizes : tuple
        Shapes of the parts that `values` is made of.
    values : array, shape (v,)
        All that is interpolated.
    at_points : array, shape (p, n + 3)
        Potentials of modes, scaled as f, and of rotation, at single points; NaN at dry ones.
    """

    angle: float
    sizes: tuple[tuple[int, ...], ...]
    values: Array
    at_points: Array

    def parts(self, values: Array) -> list[Array]:
        """Take values apart."""
        ends = np.cumsum([int(np.prod(size)) for size in self.sizes])
        pieces = np.split(values, ends[:-1])
        return [piece.reshape(size) for piece, size in zip(pieces, self.sizes, strict=True)]

    def alike(self, values: Array) -> _Node:
        """Turn the signs of the modes to those of similar ones."""
        if self.values.shape != values.shape:
            raise InputError(
                'the free surface falls into other pieces as the fill changes: no table goes '
                'over that'
            )
        parts = self.parts(self.values)
        sign = np.sign(np.sum(parts[4] * self.parts(values)[4], axis=(0, 1)))
        parts[1] = parts[1] * sign[:, np.newaxis]
        parts[4], parts[5] = parts[4] * sign, parts[5] * sign
        at_points = self.at_points * np.concatenate([sign, np.ones(3)])
        values = np.concatenate([part.ravel() for part in parts])
        return replace(self, values=values, at_points=at_points)


@dataclass(eq=False)
class _Interval:
    """
    Nodes of an interval of t, and the polynomial through them.

    Where the wall has a sharp corner at its beginning, it is a polynomial in the cube root of the
    way from there. Just above it, the wave at the wall changes as a broken power of that way.
    Just below a corner there is nothing of that: the liquid does not know the wall above.
    """

    begin: float
    end: float
    nodes: list[_Node]
    at_corner: bool
    error: float = np.inf
    values: Array | None = None  # of all nodes, once there will be no more

    def weights(self, angle: float) -> Array:
        """Weights of the nodes' values at a place, shape (n,)."""
        known = self._way(np.array([node.angle for node in self.nodes]))
        away = self._way(np.array(angle)) - known
        if not away.all():
            return np.asarray((away == 0.0).astype(float))
        between = 4.0 * (known[:, np.newaxis] - known) + np.eye(len(known))
        weights = 1.0 / (between.prod(axis=1) * away)
        return np.asarray(weights / weights.sum())

    def at(self, angle: float) -> Array:
        """Interpolated values, shape (v,)."""
        values = self.values
        if values is None:
            values = np.stack([node.values for node in self.nodes])
        return np.asarray(self.weights(angle) @ values)

    def add(self, node: _Node) -> None:
        """Take one more node; from each to the next the modes keep their signs."""
        nodes = sorted([*self.nodes, node], key=lambda node: node.angle)
        self.nodes = nodes[:1]
        for other in nodes[1:]:
            self.nodes.append(other.alike(self.nodes[-1].values))

    def next(self) -> float:
        """Place of the next node: Leja's, that is where the present ones leave most room."""
        t = np.array([node.angle for node in self.nodes])
        for edge in (self.begin, self.end):
            if edge not in t:
                return edge
        ways = (1.0 - np.cos(np.linspace(0.0, np.pi, _CANDIDATES))) / 2.0
        away = np.abs(ways[:, np.newaxis] - self._way(t))
        way = float(ways[np.log(np.maximum(away, 1e-300)).sum(axis=1).argmax()])
        return self.begin + (self.end - self.begin) * (way**3 if self.at_corner else way)

    def _way(self, angle: Array) -> Array:
        """Way from the beginning, 0 to 1, in which the polynomial is one."""
        share = (angle - self.begin) / (self.end - self.begin)
        return np.cbrt(share) if self.at_corner else share


class FillTable:
    """
    Modal coefficients over the fill of a tank.

    Parameters
    ----------
    tank : Tank
        The tank.
    names : sequence of str
        The modes.
    points : array, shape (p, 3), optional
        Where pressure is wanted, in the tank frame [m].
    tolerance : float
        Error that is aimed at.
    solve : callable
        Gives the coefficients of these modes at a depth [m] for unit density; if there is none,
        the route of the tank does.

    Notes
    -----
    The solutions are found by :meth:`step`, one for each call, so that a process can do something
    else in between; :meth:`build` does all of them.
    """

    def __init__(
        self,
        tank: Tank,
        names: Sequence[str],
        points: Array | None = None,
        tolerance: float = TOLERANCE,
        solve: Callable[[float], ModalCoefficients] | None = None,
    ) -> None:
        self.tank, self.names = tank, tuple(names)
        self._solve = solve or self._by_route
        self._dear = solve is not None
        self._of_heights = _HEIGHTS if solve is None else _SWEPT_HEIGHTS
        # the 3-D route knows the highest point of a wave no better than any
        self._of_scale = 1.0 if solve is None else _SWEPT_HEIGHTS
        self._points = np.zeros((0, 3)) if points is None else points
        self._tolerance = tolerance
        self.solutions = 0
        self.solution_error = 0.0  # largest that the solutions themselves tell of
        low, high = (self._angle(tank.depth(ratio)) for ratio in FILL_RANGE)
        turns = {self._angle(depth): turn for depth, turn in corner_levels(tank)}
        places = [low, *(t for t in turns if low < t < high), high]
        self._open = [
            _Interval(a, b, [], turns.get(a, 0.0) > _SHARP) for a, b in itertools.pairwise(places)
        ]
        self._done: list[_Interval] = []
        self._ends: dict[float, _Node] = {}  # nodes at the ends of intervals
        self._crossings = self._levels()
        self._crossed: list[_Node] = []
        # of the full tank: J0 at a density of 1, and the potentials of rotation at the points
        self._full: tuple[Array, Array] | None = None
        self._curves: list[Callable[[float], Array]] | None = None

    # --- building ---

    @property
    def ready(self) -> bool:
        """Whether all solutions are found."""
        return not self._open and not self._crossings

    @property
    def error(self) -> float:
        """
        Largest error of log omega, and of couplings and inertias over the largest of their kind.

        Heights of waves at single points, over the highest, may miss by 20 times as much; of tanks
        of any shape by 100 times, and so may the highest itself, the scale that mu and lambda have
        in common. It is that of each interval before its last node, which is more than what is
        left.
        """
        return max((part.error for part in self._done), default=np.inf)

    def build(self) -> FillTable:
        """Find all solutions."""
        while not self.ready:
            self.step()
        return self

    def step(self) -> None:
        """Find one solution; with the first, that of the full tank."""
        if self._full is None:
            self._full = self._solved_full()
        if not self._open:
            angle = self._crossings.pop()
            self._crossed.append(self._solved(angle).alike(self._values(angle)))
            return
        part = max(self._open, key=lambda part: part.error)
        while (angle := part.next()) in self._ends:  # solved for as the end of the one beside it
            part.add(self._ends[angle])
        node = self._solved(angle)
        if angle in (part.begin, part.end):
            self._ends[angle] = node
        if len(part.nodes) >= _FIRST:
            guess = part.at(node.angle)
            part.error = self._missed(node.alike(guess), guess)
        part.add(node)
        late = self.solutions > (_DEAR if self._dear else _SOLUTIONS)
        if len(part.nodes) >= _MOST and part.error > self._tolerance and not late:
            self._halve(part)
        for other in list(self._open):
            enough = late and len(other.nodes) >= _ENOUGH
            if enough or (len(other.nodes) > _FIRST and other.error <= self._tolerance):
                self._open.remove(other)
                self._done.append(other)
        if not self._open:
            self._join()

    def _halve(self, part: _Interval) -> None:
        middle = min(
            part.nodes, key=lambda node: abs(node.angle - (part.begin + part.end) / 2.0)
        ).angle
        self._open.remove(part)
        for a, b, at_corner in (
            (part.begin, middle, part.at_corner),
            (middle, part.end, False),
        ):
            nodes = [node for node in part.nodes if a <= node.angle <= b]
            self._open.append(_Interval(a, b, nodes, at_corner))

    def _join(self) -> None:
        """Let modes keep their signs from each interval to the next."""
        self._done.sort(key=lambda part: part.begin)
        last: list[_Node] = []
        for part in self._done:
            nodes = part.nodes[len(last) :]
            part.nodes = list(last)
            for node in nodes:
                part.nodes.append(node.alike(part.nodes[-1].values) if part.nodes else node)
            part.values = np.stack([node.values for node in part.nodes])
            last = part.nodes[-1:]

    def _solved(self, angle: float) -> _Node:
        self.solutions += 1
        c = self._solve(self._depth(angle))
        self.names = c.names
        self.solution_error = max(self.solution_error, c.error or 0.0)
        unit = np.sqrt(np.sin(angle) / c.mu) / c.omega  # about the mean square of f, inverted
        crests = c.surface_shapes[np.newaxis] if c.crests is None else c.crests[:, ::_SPARSE]
        friction = np.zeros(0) if c.wall_friction is None else np.log(c.wall_friction)
        parts = (
            np.log(c.omega),
            c.coupling / np.sqrt(c.mu * c.mass)[:, np.newaxis],
            c.inertia_stokes_joukowski / c.mass,
            friction,
            crests * unit,
            c.surface_shapes * unit,
            c.surface_points,
            np.array(c.surface_gaps if self._solve == self._by_route else ()).reshape(-1, 2),
        )
        sizes = tuple(part.shape for part in parts)
        values = np.concatenate([part.ravel() for part in parts])
        return _Node(angle, sizes, values, self._potentials(c, unit))

    def _solved_full(self) -> tuple[Array, Array]:
        c = still(self.tank, 1.0, 1.0)
        potentials = np.zeros((0, 3))
        if len(self._points):
            assert c.potentials is not None
            potentials = c.potentials.stokes_joukowski(self._points - c.liquid.surface_centre)
        return c.inertia_stokes_joukowski, potentials

    def _by_route(self, depth: float) -> ModalCoefficients:
        return coefficients_of(self.tank, depth, 1.0, self.names)

    def _missed(self, node: _Node, guess: Array) -> float:
        """By how much a guess misses a node: error over the largest of the kind."""
        errors = [0.0]
        for k, (a, b) in enumerate(zip(node.parts(guess), node.parts(node.values), strict=True)):
            away = np.abs(a - b)
            if k == 0:
                errors.append(float(away.max()))
            elif k == 1:
                most = np.abs(b).max(axis=0)
                errors += (away.max(axis=0)[most > 0.0] / most[most > 0.0]).tolist()
            elif k == 2:
                errors.append(float(away.max() / np.abs(b).max()))
            elif k == 4:  # the scale of mu and lambda; crests right at the wall follow slowly
                highest = _highest(b)
                scale = float(np.abs(_highest(a) / highest - 1.0).max())
                errors.append(self._of_scale * scale)
                errors.append(self._of_heights * float((away.max(axis=(0, 1)) / highest).max()))
        return max(errors)

    # --- storing ---

    def stored(self) -> dict[str, Array]:
        """Return all that was found, once it is ready."""
        parts, nodes = self._done, [node for part in self._done for node in part.nodes]
        nodes += self._crossed
        sizes = nodes[0].sizes
        assert self._full is not None
        return {
            'intervals': np.array([[p.begin, p.end, p.at_corner, p.error] for p in parts]),
            'counts': np.array([len(part.nodes) for part in parts]),
            'angles': np.array([node.angle for node in nodes]),
            'dimensions': np.array([len(size) for size in sizes]),
            'sizes': np.concatenate([np.array(size, dtype=np.intp) for size in sizes]),
            'values': np.stack([node.values for node in nodes]),
            'at_points': np.stack([node.at_points for node in nodes]),
            'full_inertia': self._full[0],
            'full_potentials': self._full[1],
            'solutions': np.array(self.solutions),
            'names': np.array(self.names),
            'solution_error': np.array(self.solution_error),
        }

    def restore(self, stored: dict[str, Array]) -> None:
        """
        Take up what was found by a table for the same.

        Raises
        ------
        LookupError, ValueError
            If something is missing or does not fit.
        """
        flat = np.split(stored['sizes'], np.cumsum(stored['dimensions'])[:-1])
        sizes = tuple(tuple(int(n) for n in size) for size in flat)
        columns = zip(
            stored['angles'].tolist(), stored['values'], stored['at_points'], strict=True
        )
        nodes = [_Node(angle, sizes, *arrays) for angle, *arrays in columns]
        ends = np.cumsum(stored['counts']).tolist()
        rows = zip(stored['intervals'].tolist(), [0, *ends[:-1]], ends, strict=True)
        self._done = [
            _Interval(a, b, nodes[i:j], bool(at_corner), error, stored['values'][i:j])
            for (a, b, at_corner, error), i, j in rows
        ]
        self._crossed = nodes[ends[-1] :]
        if len(self._crossed) != len(self._crossings):
            raise ValueError('other points of pressure')
        self._full = stored['full_inertia'], stored['full_potentials']
        self._open, self._crossings = [], []
        self.solutions = int(stored['solutions'])
        self.names = tuple(stored['names'].tolist())
        self.solution_error = float(stored['solution_error'])

    # --- reading ---

    def at(self, fill_ratio: float, density: float) -> ModalCoefficients:
        """
        Coefficients at a fill.

        Parameters
        ----------
        fill_ratio : float
            Fraction of the volume, 0 to 1.
        density : float
            Of the liquid [kg/m^3].
        """
        if fill_ratio == 0.0:
            return still(self.tank, 0.0, density)
        if fill_ratio == 1.0:
            return self._closed(density)
        low, high = FILL_RANGE
        if fill_ratio < low:
            return self._fading(fill_ratio, low, fill_ratio / low, density)
        if fill_ratio > high:
            return self._fading(fill_ratio, high, (1.0 - fill_ratio) / (1.0 - high), density)
        depth = self.tank.depth(fill_ratio)
        return self._interpolated(self.tank.filled(depth), density)

    def _interpolated(self, liquid: LiquidAtRest, density: float) -> ModalCoefficients:
        angle = self._angle(liquid.depth)
        omega, coupling, inertia, friction, crests, shapes, points, gaps = (
            self._done[0].nodes[0].parts(self._values(angle))
        )
        highest = _highest(crests)
        mass = density * liquid.volume
        mu = density * np.sin(angle) / (highest * np.exp(omega)) ** 2
        return ModalCoefficients(
            route=_ROUTE,
            density=density,
            liquid=liquid,
            names=self.names,
            omega=np.exp(omega),
            mu=mu,
            coupling=coupling * np.sqrt(mu * mass)[:, np.newaxis],
            inertia_stokes_joukowski=inertia * mass,
            wall_friction=np.exp(friction) if len(friction) else None,
            surface_points=points,
            surface_shapes=shapes / highest,
            surface_gaps=tuple((float(a), float(b)) for a, b in gaps),
            potentials=self._potentials_at(angle, liquid, highest),
            error=max(self.error, self.solution_error) if self.solution_error else None,
        )

    def _fading(
        self, fill_ratio: float, edge: float, share: float, density: float
    ) -> ModalCoefficients:
        """Coefficients between an edge of `FILL_RANGE`, for share 1, and the end, for share 0."""
        c = self.at(edge, density)
        liquid = self.tank.filled(self.tank.depth(fill_ratio))
        turning = _at_centroid(c) / c.mass
        edge_angle, angle = self._angle(c.liquid.depth), self._angle(liquid.depth)
        highest = np.sqrt(density * np.sin(edge_angle) / c.mu) / c.omega
        if fill_ratio > edge:
            end = self._closed(density)
            turning = share * turning + (1.0 - share) * _at_centroid(end) / end.mass
        mass, centroid = density * liquid.volume, liquid.centroid
        return replace(
            c,
            route=FADING,
            liquid=liquid,
            mu=share * c.mu,
            coupling=share * c.coupling,
            inertia_stokes_joukowski=mass * (turning + _parallel_axis(centroid)),
            potentials=self._potentials_at(angle, liquid, highest),
        )

    def _closed(self, density: float) -> ModalCoefficients:
        """Coefficients of the full tank."""
        assert self._full is not None
        inertia, turning = self._full
        liquid = self.tank.filled(self.tank.height)
        points = self._points - liquid.surface_centre
        potentials = _AtPoints(points, np.zeros((len(points), 0)), turning)
        return still_coefficients(_ROUTE, density, liquid, density * inertia, potentials)

    def _values(self, angle: float) -> Array:
        part = next((part for part in self._done if angle <= part.end), self._done[-1])
        return part.at(min(max(angle, part.begin), part.end))

    # --- single points ---

    def _levels(self) -> list[float]:
        """Places t at which points fall dry: there a solution is wanted as well."""
        height = self.tank.height
        low, high = (self._angle(self.tank.depth(ratio)) for ratio in FILL_RANGE)
        levels = {self._angle(z + height / 2.0) for z in self._points[:, 2].tolist()}
        return sorted(level for level in levels if low < level < high)

    def _potentials(self, c: ModalCoefficients, unit: Array) -> Array:
        """Potentials of modes, scaled as f, and of rotation, NaN at dry points (p, n + 3)."""
        about = self._points - c.liquid.surface_centre
        found = np.full((len(about), len(unit) + 3), np.nan)
        wet = about[:, 2] <= _LEVEL * self.tank.height
        if wet.any() and c.potentials is not None:
            place = np.minimum(about[wet], [np.inf, np.inf, 0.0])
            found[wet, :-3] = c.potentials.modes(place) * unit
            found[wet, -3:] = c.potentials.stokes_joukowski(place)
        return found

    def _potentials_at(
        self, angle: float, liquid: LiquidAtRest, highest: Array
    ) -> Potentials | None:
        if not len(self._points):
            return None
        if self._curves is None:
            known = [node for part in self._done for node in part.nodes] + self._crossed
            by_angle = {node.angle: node.at_points for node in known}
            t = np.array(sorted(by_angle))
            values = np.array([by_angle[angle] for angle in t.tolist()])
            self._curves = [_curve(t, values[:, i]) for i in range(len(self._points))]
        found = np.array([curve(angle) for curve in self._curves])
        about = self._points - liquid.surface_centre
        return _AtPoints(about, found[:, :-3] / highest, found[:, -3:])

    # --- the angle ---

    def _angle(self, depth: float) -> float:
        return angle_at(depth, self.tank.height)

    def _depth(self, angle: float) -> float:
        return depth_at(angle, self.tank.height)


@dataclass(frozen=True, eq=False)
class _AtPoints:
    """Potentials at the points that a table was asked for, about O."""

    points: Array
    phi: Array
    omega: Array

    def _which(self, points: Array) -> list[int]:
        away = np.linalg.norm(points[:, np.newaxis] - self.points, axis=-1)
        if away.min(axis=1, initial=np.inf).max(initial=0.0) > _SAME_PLACE:
            raise InputError('the fill table was not made for these points of pressure')
        return [int(i) for i in away.argmin(axis=1)]

    def modes(self, points: Array) -> Array:
        """Potentials phi_j of the modes, shape (p, n) [-]."""
        return self.phi[self._which(points)]

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        return self.omega[self._which(points)]


def _highest(crests: Array) -> Array:
    """Largest modulus of each mode on all lines, shape (n,)."""
    return np.asarray(np.max([peaks(line) for line in crests], axis=0))


def _curve(t: Array, values: Array) -> Callable[[float], Array]:
    """Spline through what is known at places t; beyond its ends, and if nothing is, constant."""
    known = ~np.isnan(values).any(axis=1)
    if not known.any():
        return lambda _: np.zeros(values.shape[1])
    t, values = t[known], values[known]
    if len(t) == 1:
        return lambda _: values[0]
    spline = scipy.interpolate.make_interp_spline(t, values, k=min(3, len(t) - 1))
    return lambda angle: np.asarray(spline(min(max(angle, t[0]), t[-1])))


def _parallel_axis(r: Array) -> Array:
    return np.asarray(r @ r * np.eye(3) - np.outer(r, r))


def _at_centroid(c: ModalCoefficients) -> Array:
    return c.inertia_stokes_joukowski - c.mass * _parallel_axis(c.liquid.centroid)


def still(tank: Tank, fill_ratio: float, density: float) -> ModalCoefficients:
    """Coefficients of an empty (0) or a full (1) tank."""
    return coefficients_of(tank, fill_ratio * tank.height, density, 1)
