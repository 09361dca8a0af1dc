"""
Added mass of a tank from boundary elements in three dimensions, as the paper has it.

Constant panels on the wetted wall and on the mean free surface; Rankine's influence matrices come
from `capytaine`. With normals n out of the liquid, (K - 1) phi = S q for the potential phi and its
slope q along n, hence q = D phi with D = S^-1 (K - 1). Radiation by a unit velocity in the k-th
direction at e^{-i omega t} has

    q = n_k + i epsilon kappa phi on the wall, q = kappa phi on the free surface,

kappa = omega^2/g, where epsilon is the paper's artificial damping, eq (36); and eq (31) is
A_jk = rho int phi_k n_j dS over the wall. The exact D is symmetric and knows no constant potential
(the areas a of the panels given, a D is). That of the panels nearly so: it is made so, by which
poles become real and modal masses positive.

The error of constant panels falls as their size: some hundreds of panels leave 1 % of the lowest
frequency and 2 % of the masses.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass, ComplexArray
from slosh_ros.tank import Circle, Rectangle, UniformTank
from slosh_ros.tank.surface import LiquidSurface

Array = NDArray[np.float64]

_FLAT = 1e-9  # [of the surface's area] below which a panel is none


@dataclass(frozen=True, eq=False)
class Panels:
    """
    The closed surface of a liquid in panels of four corners, or three and one of them twice.

    Corners are about O in tank axes, ordered so that normals point out of the liquid.

    Attributes
    ----------
    wall : array, shape (n, 4, 3)
        Of the wetted wall [m].
    free : array, shape (m, 4, 3)
        Of the mean free surface [m].
    """

    wall: Array
    free: Array

    @classmethod
    def of_surface(cls, surface: LiquidSurface) -> Panels:
        """Take the triangles of a surface for panels."""
        return cls(*(part[:, [0, 1, 2, 2]] for part in (surface.wall, surface.free)))

    @classmethod
    def of_tank(cls, tank: UniformTank, depth: float, size: float) -> Panels:
        """
        Lay panels on a box or on a horizontal cylinder with flat ends.

        Parameters
        ----------
        tank : UniformTank
            Of rectangular or circular section.
        depth : float
            Depth of the liquid [m].
        size : float
            Length of a panel's edges, about [m].

        Raises
        ------
        TypeError
            If the section is another.
        """
        section, half = tank.section, tank.length / 2.0
        if isinstance(section, Rectangle):
            down = -depth * _places(depth, size)
            across = section.width / 2.0 * np.ones_like(down)
            floor = section.width
        elif isinstance(section, Circle):
            reach = np.arccos(1.0 - depth / section.radius)  # from the lowest point to the brim
            angle = reach * (1.0 - _places(reach * section.radius, size))
            down = section.radius * (1.0 - np.cos(angle)) - depth
            across, floor = section.radius * np.sin(angle), 0.0
            down[0] = 0.0
        else:
            raise TypeError('panels are known for boxes and horizontal cylinders only')
        # from the left brim down and up to the right one, seen from the front
        left = np.stack([-across, down], axis=-1)
        right = (left * [-1.0, 1.0])[::-1]
        bottom = left[-1] + _places(floor, size)[1:-1, np.newaxis] * (right[0] - left[-1])
        outline = np.concatenate([left, bottom, right[int(floor == 0.0) :]])
        along = half - tank.length * _places(tank.length, size)
        strip = 2.0 * _places(2.0 * across.max(), size) - 1.0
        end = np.empty((len(strip), len(down), 3))
        end[..., 0], end[..., 1], end[..., 2] = half, np.outer(strip, across), down
        lid = strip[:, np.newaxis] * left[0]
        sides = _quadrangles(_extruded(outline, along))
        front, back = _quadrangles(end[:, ::-1]), _quadrangles(end * [-1.0, 1.0, 1.0])
        return cls(np.concatenate([sides, front, back]), _quadrangles(_extruded(lid, along)))

    @property
    def count(self) -> int:
        """Number of panels."""
        return len(self.wall) + len(self.free)


class BoundaryElements:
    """
    The liquid in a tank by constant panels.

    Parameters
    ----------
    panels : Panels
        The closed surface.
    density : float
        Density of the liquid [kg/m^3].

    Raises
    ------
    InputError
        If `capytaine` is not installed, or the panels do not close.
    """

    def __init__(self, panels: Panels, density: float) -> None:
        self.density = density
        wall, free = (_geometry(part) for part in (panels.wall, panels.free))
        keep = wall[2] > _FLAT * free[2].sum()
        wall = (wall[0][keep], wall[1][keep], wall[2][keep])
        corners = np.concatenate([panels.wall[keep], panels.free])
        self.areas = np.concatenate([wall[2], free[2]])
        self._n = n = len(wall[2])
        flow = (wall[1] * wall[2][:, np.newaxis]).sum(axis=0)
        flow += (free[1] * free[2][:, np.newaxis]).sum(axis=0)
        if np.abs(flow).max() > 1e-3 * free[2].sum():
            raise InputError('the panels do not close, or are not all turned outwards')
        # n and r x n on the wall, times area
        push = np.hstack([wall[1], np.cross(wall[0], wall[1])]) * wall[2][:, np.newaxis]

        slope = _slope_of_potential(corners)
        slope[np.diag_indices_from(slope)] -= slope.sum(axis=1)
        slope *= self.areas[:, np.newaxis]
        slope = (slope + slope.T) / 2.0
        level = self.areas / self.areas.sum()
        constant = slope.sum(axis=1)  # what is left of its flow
        slope += constant.sum() * np.outer(level, level)
        slope -= np.outer(constant, level) + np.outer(level, constant)
        # on the wall with a potential of zero on the free surface: a D U = a U lambda
        self._stiffness, vectors = eigh(slope[:n, :n], np.diag(self.areas[:n]))
        self._push: Array = vectors.T @ push
        self._link: Array = vectors.T @ slope[:n, n:]
        self._free: Array = slope[n:, n:]

    @cached_property
    def omega(self) -> Array:
        """Natural frequencies of all that the panels can tell apart, rising, undamped [rad/s]."""
        schur = self._free - (self._link.T / self._stiffness) @ self._link
        kappa = eigh(schur, np.diag(self.areas[self._n :]), eigvals_only=True)
        return np.asarray(np.sqrt(GRAVITY * kappa[1:]))  # the first is the constant

    def added_mass(self, omega: ArrayLike, damping: float = 0.0) -> AddedMass:
        """
        Sweep over frequencies.

        Parameters
        ----------
        omega : array_like, shape (n,)
            Frequencies, rising and positive; infinity may be the last, without damping [rad/s].
        damping : float
            The paper's artificial damping epsilon on the walls, eq (36) [-].

        Returns
        -------
        AddedMass
            Total, about O, eq (31). The entry 33 has the term -rho g S/omega^2 of the surface S,
            which is hydrostatic.

        Raises
        ------
        InputError
            If a frequency is not positive, or infinite with damping.
        """
        frequencies = np.atleast_1d(np.asarray(omega, dtype=float))
        if not np.all(frequencies > 0.0) or (damping and not np.all(np.isfinite(frequencies))):
            raise InputError(
                'boundary elements need frequencies above 0 [rad/s], and finite ones with damping'
            )
        matrix = np.stack([self._at(w**2 / GRAVITY, damping) for w in frequencies])
        return AddedMass(
            frequencies,
            self.density * matrix,
            self.density,
            np.zeros(3),
            source=f'{len(self.areas)} boundary elements',
        )

    def _at(self, kappa: float, damping: float) -> ComplexArray:
        """Return the added mass for unit density."""
        if np.isinf(kappa):
            return np.asarray((self._push.T / self._stiffness) @ self._push, dtype=complex)
        compliance = 1.0 / (self._stiffness - 1j * damping * kappa)
        loaded = self._push.T * compliance
        schur = self._free - (self._link.T * compliance) @ self._link
        schur -= kappa * np.diag(self.areas[self._n :])
        on_free = np.linalg.solve(schur, -(loaded @ self._link).T)
        return np.asarray(loaded @ (self._push - self._link @ on_free))


def _slope_of_potential(corners: Array) -> Array:
    """Return D, which makes slopes along the normals of potentials of panels, (n, n) [1/m]."""
    try:
        import capytaine
        from capytaine.green_functions import delhommeau
    except ImportError as error:
        raise InputError(
            'boundary elements need the package capytaine: pip install "slosh_ros[bem]"'
        ) from error
    faces = np.arange(4 * len(corners)).reshape(-1, 4)
    vertices, number = np.unique(np.round(corners.reshape(-1, 3), 9), axis=0, return_inverse=True)
    mesh = capytaine.Mesh(
        vertices=vertices, faces=number.ravel()[faces], auto_clean=False, auto_check=False
    )
    # there are no waves, whose integrals it would tabulate; it says that it does, even of none
    delhommeau.LOG.disabled = True
    rankine = delhommeau.Delhommeau(tabulation_nr=0, tabulation_nz=0, tabulation_cache_dir=None)
    single, double = rankine.evaluate(
        mesh, mesh, free_surface=np.inf, water_depth=np.inf, wavenumber=0.0,
        adjoint_double_layer=False,
    )  # fmt: skip
    return np.linalg.solve(np.real(single), np.real(double) - np.eye(len(corners)))


def _geometry(panels: Array) -> tuple[Array, Array, Array]:
    """Centres, normals and areas of panels: those of their two triangles."""
    a, b, c, d = panels.transpose(1, 0, 2)
    halves = np.stack([np.cross(b - a, c - a), np.cross(c - a, d - a)]) / 2.0
    sizes = np.linalg.norm(halves, axis=2)
    middles = np.stack([a + b + c, a + c + d]) / 3.0
    area = sizes.sum(axis=0)
    safe = np.maximum(area, np.finfo(float).tiny)[:, np.newaxis]
    centre = np.sum(middles * sizes[..., np.newaxis], axis=0) / safe
    return centre, halves.sum(axis=0) / safe, area


def _places(length: float, size: float) -> Array:
    """Divide a line from 0 to 1 into equal parts; their ends."""
    return np.linspace(0.0, 1.0, max(1, round(length / size)) + 1)


def _extruded(line: Array, along: Array) -> Array:
    """Net of points of a line in y, z at each x, shape (x, line, 3)."""
    net = np.empty((len(along), len(line), 3))
    net[..., 0], net[..., 1:] = along[:, np.newaxis], line
    return net


def _quadrangles(net: Array) -> Array:
    """Panels between the points of a net, shape (n, m, 3)."""
    panels = np.stack([net[:-1, :-1], net[1:, :-1], net[1:, 1:], net[:-1, 1:]], axis=-2)
    return panels.reshape(-1, 4, 3)
