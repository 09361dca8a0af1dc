"""The list of items, in the order of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from slosh_ros.errors import InputError
from slosh_ros.study.paper import (
    frequency,
    manoeuvres,
    measured,
    pitching,
    slips,
    tables,
    truck,
    trust,
)
from slosh_ros.study.paper.item import Item
from slosh_ros.study.paper.report import Found

ITEMS = (
    Item('table1', 'Table 1: coefficients of a rectangular tank', tables.table_1),
    Item('three_modes', 'Section 4.2: three modes fitted', tables.three_modes),
    Item('fig3', 'Figure 3: added mass of the rectangular tank', frequency.figure_3),
    Item('table2', 'Table 2: coefficients of a horizontal cylinder', tables.table_2),
    Item('fig5', 'Figure 5: added mass of the horizontal cylinder', frequency.figure_5),
    Item('fig6', 'Figure 6: braking', manoeuvres.figure_6),
    Item('fig7', 'Figure 7: acceleration while turning', manoeuvres.figure_7),
    Item('fig8', 'Figure 8: turning', manoeuvres.figure_8),
    Item('fig9', 'Figure 9: wall pressure under pitching', pitching.figure_9),
    Item('table3', 'Table 3: lengths of the truck', tables.table_3),
    Item('table4', 'Table 4: coefficients of the tank of the truck', tables.table_4),
    Item('fig11', 'Figure 11: braking truck, deceleration', truck.figure_11),
    Item('fig12', 'Figure 12: braking truck, force and moment', truck.figure_12),
    Item('fig13', 'Figure 13: braking truck, pitch', truck.figure_13),
    Item('fig14', 'Figure 14: truck accelerating at 0.1 g', truck.figure_14),
    Item('fig15', 'Figure 15: truck accelerating at 0.2 g', truck.figure_15),
    Item('errors_sloshing', 'Slips in sections 2 to 4', slips.sloshing),
    Item('errors_vehicle', 'Slips in eqs (38) and (39)', slips.vehicle),
    Item('cfd_cylinder', 'Two-phase CFD: braking cylinder of Figure 6', measured.cylinder),
    Item('cfd_rectangle', 'Two-phase CFD: shallow rectangle', measured.rectangles),
    Item('faltinsen2000', 'Measured wave height, Faltinsen et al. 2000', measured.faltinsen),
    Item('akyildiz2006', 'Measured wall pressure, Akyildiz & Unal 2006', pitching.akyildiz),
    Item('trust', 'What to expect of linear theory', trust.expectations),
)


def reproduce(
    names: Sequence[str] = (), progress: Callable[[str], None] = lambda _: None
) -> Iterator[Found]:
    """
    Compute items, one after the other.

    Parameters
    ----------
    names : sequence of str
        Which; none for all.
    progress : callable, optional
        Told the title of each item before it is computed.

    Yields
    ------
    Found

    Raises
    ------
    InputError
        If there is no item of a name.
    """
    for item in chosen(names):
        progress(item.title)
        yield Found(item, item.find())


def chosen(names: Sequence[str]) -> tuple[Item, ...]:
    """Items of the given names, all for none."""
    known = {item.name for item in ITEMS}
    for name in names:
        if name not in known:
            raise InputError(
                f'there is no item {name}; choose of {", ".join(item.name for item in ITEMS)}'
            )
    return tuple(item for item in ITEMS if not names or item.name in names)
