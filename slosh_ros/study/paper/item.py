"""What every item of the report is made of: rows with verdicts, tables, drawings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class Verdict(Enum):
    """What a comparison came to; the value says it to people."""

    REPRODUCED = 'reproduced'
    MISPRINT = "paper's misprint"
    OPEN = 'not determinable'
    DIFFERENT = 'not reproduced'
    BEYOND = 'beyond linear theory'

    @property
    def meaning(self) -> str:
        """One sentence for the legend of the report."""
        return _MEANINGS[self]


_MEANINGS = {
    Verdict.REPRODUCED: 'our number is theirs, within the digits printed or the tolerance shown',
    Verdict.MISPRINT: (
        'what is printed contradicts other numbers, equations or units of the paper; '
        'the evidence is computed'
    ),
    Verdict.OPEN: 'the text does not state what one would need (its pictures are not in it)',
    Verdict.DIFFERENT: 'all that is needed is stated, and we come to something else',
    Verdict.BEYOND: 'the waves are too high, or too near to breaking, for the theory',
}


@dataclass(frozen=True)
class Row:
    """
    One comparison.

    Attributes
    ----------
    key : str
        Its name within the item.
    what : str
        What is compared.
    ours, theirs : str
        Our number or finding; the paper's or the measured one, as printed; empty if there is none.
    unit : str
        Of both.
    difference : float or None
        Ours less theirs over the magnitude of theirs.
    tolerance : float or None
        Largest relative difference that counts as reproduced.
    verdict : Verdict
        What it came to.
    why : str
        The difference, explained.
    evidence : str
        Where the number comes from.
    head : bool
        Whether it is shown in the summary.
    """

    key: str
    what: str
    ours: str
    theirs: str
    unit: str
    difference: float | None
    tolerance: float | None
    verdict: Verdict
    why: str = ''
    evidence: str = ''
    head: bool = False


@dataclass(frozen=True, eq=False)
class Drawing:
    """
    A figure and the numbers in it.

    Attributes
    ----------
    name : str
        Of its files, without ending.
    caption : str
        What is to be seen.
    figure : Figure
        The picture.
    columns : dict
        Arrays by name, with units, for the CSV; they may differ in length.
    """

    name: str
    caption: str
    figure: Figure
    columns: Mapping[str, ArrayLike]


@dataclass(frozen=True)
class Grid:
    """A table of its own: caption, heads, rows of text."""

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, eq=False)
class Finding:
    """What an item came to."""

    rows: Sequence[Row]
    text: Sequence[str] = ()
    drawings: Sequence[Drawing] = ()
    grids: Sequence[Grid] = field(default=())


@dataclass(frozen=True)
class Item:
    """
    A table, a figure or a set of numbers of the paper, or a measurement.

    Attributes
    ----------
    name : str
        For `--only`.
    title : str
        Its heading.
    find : callable
        Computes it.
    """

    name: str
    title: str
    find: Callable[[], Finding]


def against(
    key: str,
    what: str,
    ours: float,
    theirs: str,
    unit: str,
    *,
    within: float | None = None,
    otherwise: Verdict = Verdict.DIFFERENT,
    why: str = '',
    evidence: str = '',
    head: bool = False,
) -> Row:
    """
    Judge a number of ours against a printed one.

    Parameters
    ----------
    key, what, unit, why, evidence, head
        See `Row`.
    ours : float
        Our number.
    theirs : str
        The number as printed.
    within : float, optional
        Relative tolerance; by default ours must round to the printed digits.
    otherwise : Verdict
        The verdict if it is not reproduced.
    """
    printed = float(theirs)
    decimals = len(theirs.partition('.')[2])
    allowed = 0.5001 * 10.0**-decimals if within is None else within * abs(printed)
    good = abs(ours - printed) <= allowed
    return Row(
        key=key,
        what=what,
        ours=f'{ours:.{decimals + 1}f}',
        theirs=theirs,
        unit=unit,
        difference=(ours - printed) / abs(printed),
        tolerance=within,
        verdict=Verdict.REPRODUCED if good else otherwise,
        why=why,
        evidence=evidence,
        head=head,
    )


def claim(
    key: str,
    what: str,
    ours: str,
    theirs: str,
    holds: bool | np.bool_,
    *,
    unit: str = '',
    verdict: Verdict = Verdict.REPRODUCED,
    why: str = '',
    evidence: str = '',
    head: bool = False,
) -> Row:
    """
    Judge a statement by a computation: `verdict` if it holds, else not reproduced.

    Parameters
    ----------
    key, what, ours, theirs, unit, verdict, why, evidence, head
        See `Row`.
    holds : bool
        Whether the computation bears the verdict out.
    """
    return Row(
        key=key,
        what=what,
        ours=ours,
        theirs=theirs,
        unit=unit,
        difference=None,
        tolerance=None,
        verdict=verdict if holds else Verdict.DIFFERENT,
        why=why,
        evidence=evidence,
        head=head,
    )
