"""
The paper and the experiments, recomputed: `slosh paper`.

An item is one function that returns a `Finding`: rows with verdicts, drawings, text. They stand in
one list, `ITEMS`; `report` writes whatever they return. The physics is all elsewhere: items call
engine, scenarios and solvers as a user would.
"""

from slosh_ros.study.paper.item import Verdict
from slosh_ros.study.paper.items import ITEMS, chosen, reproduce
from slosh_ros.study.paper.report import Found, as_json, write_report

__all__ = ['ITEMS', 'Found', 'Verdict', 'as_json', 'chosen', 'reproduce', 'write_report']
