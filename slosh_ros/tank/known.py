"""A liquid that is known at one fill only, in a tank whose walls are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.tank.uniform import LiquidAtRest

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KnownLiquid:
    """
    A tank of which nothing is known but the liquid in it.

    It has one fill. Its walls are taken for upright where the surface meets them, and no point of
    it can be told to be wet.

    Parameters
    ----------
    liquid : LiquidAtRest
        The liquid.
    volume : float
        Of the whole tank [m^3].
    """

    liquid: LiquidAtRest
    volume: float
    repairs: ClassVar[tuple[str, ...]] = ()  # of what is given in a file

    @property
    def shape(self) -> str:
        """Name of the shape, as in the configuration."""
        return 'added_mass'

    @property
    def height(self) -> float:
        """Inner height [m]."""
        return self.liquid.depth + self.liquid.freeboard

    def fill_ratio(self, depth: float) -> float:
        """Fraction of the volume up to a depth [m], between the upright walls at the surface."""
        return self.liquid.fill_ratio * depth / self.liquid.depth

    def depth(self, fill_ratio: float) -> float:
        """
        Return the depth [m] of the one fill ratio there is.

        Raises
        ------
        InputError
            If it is another.
        """
        own = self.liquid.fill_ratio
        if not np.isclose(fill_ratio, own, rtol=1e-6):
            raise InputError(
                f'this liquid is known at one fill only, {own:.4g} of the tank; at {fill_ratio:g} '
                'it needs an added mass of its own'
            )
        return self.liquid.depth

    def filled(self, depth: float) -> LiquidAtRest:
        """
        Return the liquid.

        Raises
        ------
        InputError
            If the depth [m] is another.
        """
        if not np.isclose(depth, self.liquid.depth, rtol=1e-6):
            raise InputError(
                f'this liquid is known at one fill only, {self.liquid.depth:g} m deep; '
                f'{depth:g} m need an added mass of their own'
            )
        return self.liquid

    def outlines(self) -> tuple[Array, Array]:
        """
        Refuse: where the walls are is not known.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError('the walls of a tank of added mass are not known: there is no picture')

    def nearest(self, depth: float, point: Array) -> Array:
        """
        Refuse: where the walls are is not known.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError(
            f'the walls of this tank are not known, so nobody can tell whether '
            f'({", ".join(f"{c:g}" for c in point)}) m at a depth of {depth:g} m is in the liquid'
        )
