"""Functions on the liquid's section, and their integrals: what every discretisation must give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from slosh_ros.hydro.coefficients import Array


class Parity(IntEnum):
    """Symmetry of functions in y."""

    EVEN = 0
    ODD = 1
    NONE = 2


@dataclass(frozen=True, eq=False)
class SectionFunctions:
    """
    Functions v on the liquid in a section and their integrals, all about O.

    Attributes
    ----------
    parity : Parity
        Symmetry of all of them in y.
    has_constant : bool
        Whether the constant is among them: unless they are odd.
    stiffness, mass : array, shape (n, n)
        Integrals over the area of grad v_i . grad v_j and of v_i v_j.
    d_dy, d_dz, y, z, roll : array, shape (n,)
        Integrals over the area of dv/dy, dv/dz, y v, z v and y dv/dz - z dv/dy.
    wall_mass, wall_stiffness : array, shape (n, n)
        Integrals over the wall of v_i v_j and of their derivatives along it.
    surface_root : array, shape (n, m)
        C, of which C C^T are the integrals over the free surface of v_i v_j.
    surface_one, surface_y : array, shape (n,)
        Integrals over the free surface of v and y v.
    at_surface : callable
        Values of the first m of them at places y of the free surface, where the others vanish:
        array, shape (p,), to array, shape (p, m).
    at : callable
        Values at points y, z of the liquid: array, shape (p, 2), to array, shape (p, n).
    """

    parity: Parity
    has_constant: bool
    stiffness: Array
    mass: Array
    d_dy: Array
    d_dz: Array
    y: Array
    z: Array
    roll: Array
    wall_mass: Array
    wall_stiffness: Array
    surface_root: Array
    surface_one: Array
    surface_y: Array
    at_surface: Callable[[Array], Array]
    at: Callable[[Array], Array]
