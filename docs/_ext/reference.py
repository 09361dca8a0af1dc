"""
The reference pages that nobody writes: from parameter tables and command lines.

In a page, `{parameters} slosh_node` stands for the list of that node's parameters, and
`{command} replay` for the arguments and options of `slosh replay`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_type_hints

import typer.main
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from slosh_ros import cli
from slosh_ros.engine import parameters as engine
from slosh_ros.engine.shapes import SHAPES
from slosh_ros.parameters import Parameter
from slosh_ros.vehicle import rollover, scenario

TABLES: Mapping[str, tuple[Parameter, ...]] = {
    'slosh_node': engine.PARAMETERS,
    'rollover_node': tuple(rollover.PARAMETERS.values()),
    'vehicle_node': tuple(scenario.PARAMETERS.values()),
}
_WORDS = {Path: 'FILE', float: 'NUMBER', int: 'NUMBER', str: 'TEXT'}  # values of options


def parameter_list(node: str) -> str:
    """Parameters of a node as a MyST definition list, under the first part of their names."""
    lines: list[str] = []
    groups: dict[str, list[Parameter]] = {}
    for row in TABLES[node]:
        groups.setdefault(_group(row), []).append(row)
    for group, rows in groups.items():
        lines += ['', f'**{group}**', ''] if group else ['']
        for row in rows:
            default = '' if row.default is None else f', default {_literal(row.default)}'
            unit = f' [{row.unit}]' if row.unit else ''
            lines += [
                f'`{row.name}` ({row.kind}{unit}{default}{", *live*" * row.live})',
                f': {row.meaning}' + (f'; {row.constraints}' if row.constraints else '') + '.',
                '',
            ]
    return '\n'.join(lines)


def shape_table() -> str:
    """Shapes of tanks, with what they need, as a MyST table."""
    lines = _head('shape', 'needs', 'may take')
    for name, shape in SHAPES.items():
        needs, takes = (', '.join(f'`{p}`' for p in group) for group in (shape.needs, shape.takes))
        lines.append(f'| `{name}` | {needs} | {takes} |')
    return '\n'.join([*lines, ''])


def command_table(name: str) -> str:
    """Arguments and options of a subcommand as a MyST table."""
    command = typer.main.get_command(cli.app).commands[name]
    function = next(
        known.callback for known in cli.app.registered_commands if known.callback.__name__ == name
    )
    types = get_type_hints(function)
    lines = [_cell(command.help), '', *_head('argument or option', 'default', 'meaning')]
    for parameter in command.params:
        if parameter.name not in types:
            continue  # --help, which some versions list
        default = '' if parameter.default in (None, False) else f'`{parameter.default}`'
        told = f'{"needed" if parameter.required else default} | {_cell(parameter.help)}'
        lines.append(f'| {_usage(parameter, types[parameter.name])} | {told} |')
    return '\n'.join([*lines, ''])


def command_names() -> list[str]:
    """Names of all subcommands of `slosh`."""
    return list(typer.main.get_command(cli.app).commands)


def _usage(parameter: Any, kind: Any) -> str:
    if parameter.param_type_name == 'argument':
        return f'`{parameter.metavar or parameter.name.upper()}`'
    inner = {argument: word for argument, word in _WORDS.items() if argument.__name__ in str(kind)}
    value = parameter.metavar or next(iter(inner.values()), '')
    return ', '.join(f'`{_cell(f"{name} {value}")}`' for name in parameter.opts)


def _group(row: Parameter) -> str:
    first, dot, _ = row.name.partition('.')
    return first.replace(engine.TANK, 'each tank') if dot else ''


def _literal(value: object) -> str:
    shown = str(value).lower() if isinstance(value, bool) else str(value)
    return f'`{shown}`' if shown else 'empty'


def _head(*names: str) -> list[str]:
    return ['| ' + ' | '.join(names) + ' |', '|---' * len(names) + '|']


def _cell(text: str) -> str:
    return text.replace('|', r'\|').replace('\n', ' ').strip()


class Generated(SphinxDirective):
    """Puts a generated table in its place."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Parse the table as part of the page."""
        what = self.arguments[0]
        make = {'parameters': parameter_list, 'command': command_table}.get(self.name)
        text = shape_table() if make is None else make(what)
        return self.parse_text_to_nodes(text, allow_section_headings=False)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    for name in ('parameters', 'command', 'shapes'):
        app.add_directive(name, Generated)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
