"""The report as HTML, Markdown and JSON, its figures as PNG, their numbers as CSV."""

from __future__ import annotations

import base64
import io
import itertools
import json
from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

import slosh_ros
from slosh_ros.errors import InputError
from slosh_ros.study.paper.item import Drawing, Finding, Item, Row, Verdict

TITLE = 'Sloshing in vehicle tanks: the paper and the experiments, recomputed'
_PAPER = 'https://doi.org/10.1155/2019/6943879'
_LEAD = (
    'Every table and figure of Han, Dai, Wang & Ang (2019), Hydrodynamic Analysis of Partially '
    'Filled Liquid Tanks Subject to 3D Vehicular Manoeuvring, recomputed by the code of slosh_ros '
    'and set beside what is printed; then the same with computed and measured sloshing. Figures '
    '1, 2, 4 and 10 of the paper are sketches. We had the text of the paper, not its pages: an '
    'oddity may be one of that text. Most of what does not agree is a slip of print. The method '
    'is sound, and this package is built on it.'
)
_SIGNS = {
    Verdict.REPRODUCED: '✓', Verdict.MISPRINT: '✎', Verdict.OPEN: '?', Verdict.DIFFERENT: '≠',
    Verdict.BEYOND: '≈',
}  # fmt: skip
_HEADS = ('', 'ours', 'paper or measured', 'difference', 'verdict')
_FIGURES = 'figures'


class Found(NamedTuple):
    """An item, and what it came to."""

    item: Item
    finding: Finding


def write_report(found: Sequence[Found], out: Path) -> None:
    """
    Write `index.html`, `report.md`, `paper.json` and the folder `figures`.

    Parameters
    ----------
    found : sequence of Found
        What the report is made of.
    out : Path
        Folder; it is made if need be.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    folder = out / _FIGURES
    try:
        folder.mkdir(parents=True, exist_ok=True)
        pictures = {
            drawing.name: _save(drawing, folder)
            for one in found
            for drawing in one.finding.drawings
        }
        (out / 'index.html').write_text(_html(found, pictures), encoding='utf-8')
        (out / 'report.md').write_text(_markdown(found), encoding='utf-8')
        (out / 'paper.json').write_text(
            json.dumps(as_json(found), indent=1, ensure_ascii=False) + '\n', encoding='utf-8'
        )
    except OSError as error:
        raise InputError(f'{out}: cannot be written: {error.strerror}') from error


def as_json(found: Sequence[Found]) -> dict[str, object]:
    """Give the verdicts as data."""
    return {
        'paper': _PAPER,
        'version': slosh_ros.__version__,
        'counts': {v.value: n for v, n in counts(found).items()},
        'items': [
            {
                'name': one.item.name,
                'title': one.item.title,
                'rows': [_row_as_json(row) for row in one.finding.rows],
                'figures': [
                    {'png': f'{_FIGURES}/{d.name}.png', 'csv': f'{_FIGURES}/{d.name}.csv'}
                    for d in one.finding.drawings
                ],
            }
            for one in found
        ],
    }


def counts(found: Sequence[Found]) -> dict[Verdict, int]:
    """Count rows by verdict, all verdicts in their order."""
    number = Counter(row.verdict for one in found for row in one.finding.rows)
    return {verdict: number[verdict] for verdict in Verdict}


def _row_as_json(row: Row) -> dict[str, object]:
    return {
        'key': row.key, 'what': row.what, 'ours': row.ours, 'theirs': row.theirs,
        'unit': row.unit, 'difference': row.difference, 'tolerance': row.tolerance,
        'verdict': row.verdict.value, 'why': row.why, 'evidence': row.evidence,
    }  # fmt: skip


def _save(drawing: Drawing, folder: Path) -> bytes:
    """Write picture and numbers; return the picture."""
    buffer = io.BytesIO()
    drawing.figure.savefig(buffer, format='png', dpi=140)
    (folder / f'{drawing.name}.png').write_bytes(buffer.getvalue())
    columns = [np.asarray(column, dtype=float).tolist() for column in drawing.columns.values()]
    with (folder / f'{drawing.name}.csv').open('w', encoding='utf-8') as file:
        file.write(','.join(f'"{name}"' for name in drawing.columns) + '\n')
        for row in itertools.zip_longest(*columns, fillvalue=''):
            file.write(','.join('' if x == '' else f'{x:.9g}' for x in row) + '\n')
    return buffer.getvalue()


def _difference(row: Row) -> str:
    if row.difference is None:
        return ''
    text = f'{row.difference:+.2%}' if abs(row.difference) < 0.1 else f'{row.difference:+.1%}'
    return f'{text} (limit {row.tolerance:.1%})' if (row.tolerance or 0.0) > 1e-3 else text


def _cells(row: Row) -> tuple[str, str, str, str, str]:
    """Write the cells of a row, as in `_HEADS`."""
    unit = f' [{row.unit}]' if row.unit and row.unit != '-' else ''
    sign = f'{_SIGNS[row.verdict]} {row.verdict.value}'
    return row.what + unit, row.ours, row.theirs, _difference(row), sign


def _notes(row: Row) -> str:
    evidence = f'Evidence: {row.evidence}.' if row.evidence else ''
    return f'{row.why}. {evidence}'.strip() if row.why else evidence


def _anchor(item: Item, row: Row) -> str:
    """Name the place of a row: links of the summary lead there."""
    return f'{item.name}.{row.key}'


def _heads(found: Sequence[Found]) -> list[tuple[Item, Row]]:
    return [(one.item, row) for one in found for row in one.finding.rows if row.head]


# --- Markdown ----------------------------------------------------------------------------------


def _markdown(found: Sequence[Found]) -> str:
    lines = [f'# {TITLE}', '', _LEAD, '', f'Paper: {_PAPER}', '', '| verdict | rows | meaning |',
             '|---|---|---|']  # fmt: skip
    lines += [f'| {_SIGNS[v]} {v.value} | {n} | {v.meaning} |' for v, n in counts(found).items()]
    lines += ['', '## Summary', '', _line(('item', *_HEADS)), '|---' * 6 + '|']
    lines += [
        _line((f'[{item.name}](#{_anchor(item, row)})', *_cells(row)))
        for item, row in _heads(found)
    ]
    for item, finding in found:
        lines += ['', f'<a id="{item.name}"></a>', '', f'## {item.title}', '']
        for paragraph in finding.text:
            lines += [paragraph, '']
        for d in finding.drawings:
            lines += [f'![{d.caption}]({_FIGURES}/{d.name}.png)', '',
                      f'*{d.caption}* [Numbers]({_FIGURES}/{d.name}.csv)', '']  # fmt: skip
        if finding.rows:
            lines += [_line((*_HEADS, 'why, and evidence')), '|---' * 6 + '|']
            lines += [
                _line((f'<a id="{_anchor(item, row)}"></a>{what}', *cells, _notes(row)))
                for row, (what, *cells) in ((row, _cells(row)) for row in finding.rows)
            ]
        for grid in finding.grids:
            rule = '|---' * len(grid.heads) + '|'
            lines += ['', f'*{grid.caption}*', '', _line(grid.heads), rule]
            lines += [_line(row) for row in grid.rows]
    return '\n'.join(lines) + '\n'


def _line(cells: Sequence[str]) -> str:
    return '| ' + ' | '.join(cell.replace('|', r'\|') for cell in cells) + ' |'


# --- HTML --------------------------------------------------------------------------------------

_STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 62rem; margin: 0 auto;
  padding: 0 1rem 4rem; }
h1 { font-size: 1.6rem; line-height: 1.2; } h2 { font-size: 1.2rem; margin-top: 3rem;
  border-top: 1px solid #bbb; padding-top: 1rem; }
img { max-width: 100%; height: auto; } figure { margin: 1rem 0; }
figcaption, caption { font-size: .85rem; color: #444; text-align: left; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: .88rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .5rem; overflow-wrap: anywhere;
  border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #666; overflow-wrap: normal; }
td.note { color: #444; border-bottom: 2px solid #ddd; padding-top: 0; }
tr.noted td { border-bottom: none; }
.item { overflow-wrap: normal; }
.verdict { white-space: nowrap; overflow-wrap: normal; font-weight: 600; }
tr:target { background: #fff3c4; }
.REPRODUCED { color: #00603f; } .MISPRINT { color: #a34700; } .OPEN { color: #444; }
.DIFFERENT { color: #7a0a3c; } .BEYOND { color: #004d80; }
a { color: #00508a; }
@media (max-width: 46rem) {
  table.rows thead { display: none; }
  table.rows tr { display: block; padding: .4rem 0; border-bottom: 1px solid #bbb; }
  table.rows tr.noted { border-bottom: none; padding-bottom: 0; }
  table.rows td { display: block; border: none; padding: .05rem 0; }
  table.rows td[data-head]:not([data-head=""])::before { content: attr(data-head) ": ";
    color: #666; }
  .verdict { white-space: normal; }
  .grid { overflow-x: auto; }
}
"""


def _html(found: Sequence[Found], pictures: dict[str, bytes]) -> str:
    parts = [
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<title>{escape(TITLE)}</title><style>{_STYLE}</style></head><body>',
        f'<h1>{escape(TITLE)}</h1><p>{escape(_LEAD)}</p>',
        f'<p>Paper: <a href="{_PAPER}">{_PAPER}</a>. slosh_ros {slosh_ros.__version__}.</p>',
        '<table><thead><tr><th>verdict</th><th>rows</th><th>meaning</th></tr></thead><tbody>',
        *(
            f'<tr><td class="verdict {v.name}">{_SIGNS[v]} {escape(v.value)}</td><td>{n}</td>'
            f'<td>{escape(v.meaning)}</td></tr>'
            for v, n in counts(found).items()
        ),
        '</tbody></table>',
    ]
    if heads := _heads(found):
        parts += ['<h2 id="summary">Summary</h2>', _table_head(('item', *_HEADS))]
        parts += [
            _table_row(row, first=f'<a href="#{_anchor(item, row)}">{item.name}</a>')
            for item, row in heads
        ]
        parts.append('</tbody></table>')
    for item, finding in found:
        parts.append(f'<h2 id="{item.name}">{escape(item.title)}</h2>')
        parts += [f'<p>{escape(paragraph)}</p>' for paragraph in finding.text]
        for d in finding.drawings:
            data = base64.b64encode(pictures[d.name]).decode('ascii')
            parts.append(
                f'<figure><img alt="{escape(d.caption)}" src="data:image/png;base64,{data}">'
                f'<figcaption>{escape(d.caption)} (<a href="{_FIGURES}/{d.name}.csv">numbers</a>)'
                '</figcaption></figure>'
            )
        if finding.rows:
            parts += [
                _table_head(_HEADS),
                *(_table_row(row, anchor=_anchor(item, row)) for row in finding.rows),
                '</tbody></table>',
            ]
        for grid in finding.grids:
            parts.append(
                f'<div class="grid"><table><caption>{escape(grid.caption)}</caption><thead><tr>'
                + ''.join(f'<th>{escape(h)}</th>' for h in grid.heads)
                + '</tr></thead><tbody>'
            )
            parts += [
                '<tr>' + ''.join(f'<td>{escape(cell)}</td>' for cell in row) + '</tr>'
                for row in grid.rows
            ]
            parts.append('</tbody></table></div>')
        parts.append('<p><a href="#summary">Summary</a></p>')
    return '\n'.join([*parts, '</body></html>', ''])


def _table_head(heads: Sequence[str]) -> str:
    cells = ''.join(f'<th>{escape(head)}</th>' for head in heads)
    return f'<table class="rows"><thead><tr>{cells}</tr></thead><tbody>'


def _table_row(row: Row, first: str = '', anchor: str = '') -> str:
    """Write a row with its notes under an anchor, or, behind a first cell, without them."""
    *cells, verdict = _cells(row)
    notes = _notes(row) if anchor else ''
    html = f'<tr id="{anchor}"' if anchor else '<tr'
    html += ' class="noted">' if notes else '>'
    if first:
        html += f'<td data-head="" class="item">{first}</td>'
    html += ''.join(
        f'<td data-head="{head if cell else ""}">{escape(cell)}</td>'
        for head, cell in zip(_HEADS, cells, strict=False)
    )
    html += f'<td data-head="" class="verdict {row.verdict.name}">{escape(verdict)}</td></tr>'
    if notes:
        html += f'<tr><td class="note" colspan="{len(_HEADS)}">{escape(notes)}</td></tr>'
    return html
