"""The manual tells all there is: parameters, commands, topics, columns, verdicts, limits."""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import pytest
from conftest import REPOSITORY
from test_architecture import HOUSE
from test_launch import ARGUMENTS

from slosh_ros.bag.writer import COLUMNS, ROLLOVER_COLUMNS
from slosh_ros.engine import SloshConfig, Verdict
from slosh_ros.modal import validity
from slosh_ros.study.tanks import liquids_of
from slosh_ros.vehicle.scenario import Scenario

DOCS = REPOSITORY / 'docs'
BRAKE = REPOSITORY / 'config' / 'scenarios' / 'brake.yaml'
PAGES = {path.relative_to(DOCS).as_posix(): path.read_text() for path in DOCS.rglob('*.md')}
README = (REPOSITORY / 'README.md').read_text()
BLOCK = re.compile(r'^```(\w+)\n(.*?)^```', re.DOTALL | re.MULTILINE)
CODE = [(page, *block) for page, text in PAGES.items() for block in BLOCK.findall(text)]

CONSOLE = [
    code
    for text in (README, *PAGES.values())
    for language, code in BLOCK.findall(text)
    if language == 'console'
]


def blocks(language: str) -> list[tuple[str, str]]:
    return [(page, code) for page, kind, code in CODE if kind == language]


def rows(page: str, section: str = '') -> list[list[str]]:
    """Cells of the tables of a page, or of one of its sections."""
    text = PAGES[page]
    if section:
        (text,) = re.findall(rf'^## {section}\n(.*?)(?=^## |\Z)', text, re.DOTALL | re.MULTILINE)
    lines = [line for line in text.splitlines() if line.startswith('|') and '|---' not in line]
    return [[cell.strip() for cell in line.strip('|').split('|')] for line in lines]


def test_every_page_is_in_a_table_of_contents() -> None:
    listed = set(re.findall(r'^\w+/\w+$', PAGES['index.md'], re.MULTILINE))
    assert listed == {page.removesuffix('.md') for page in PAGES} - {'index'}


# --- examples ----------------------------------------------------------------------------------


@pytest.mark.parametrize(('page', 'code'), blocks('yaml'), ids=lambda value: value[:24])
def test_parameter_files_are_good(page: str, code: str, tmp_path: Path) -> None:
    file = tmp_path / 'example.yaml'
    file.write_text(code)
    assert SloshConfig.from_file(file).tanks


@pytest.mark.parametrize('page', sorted({page for page, _ in blocks('python')}))
def test_python_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'config').symlink_to(REPOSITORY / 'config')
    if page == 'howto/own_bem.md':  # extras
        for library in ('capytaine', 'xarray', 'netCDF4'):
            pytest.importorskip(library)
    exec('\n'.join(code for where, code in blocks('python') if where == page), {})


@pytest.mark.parametrize(
    'command', sorted({line for code in CONSOLE for line in code.splitlines()})
)
def test_what_commands_name_is_there(command: str) -> None:
    """`slosh` commands are run by test_readme.py; this is about the others, and their files."""
    program, *words = command.split()
    if program == 'make':
        targets = re.findall(r'^([a-z-]+):.*## ', (REPOSITORY / 'Makefile').read_text(), re.M)
        assert words[0] in targets
    elif program == 'ros2' and words[0] == 'launch':
        name = words[2].removesuffix('.launch.py')
        given = dict(word.split(':=') for word in words[3:])
        assert words[1] == 'slosh_ros'
        assert given.keys() <= ARGUMENTS[name]
        scenario = given.get('scenario', 'brake_bump')
        assert (REPOSITORY / 'config' / 'scenarios' / f'{scenario}.yaml').exists()
    else:
        assert program in ('slosh', 'colcon', 'source', 'ros2'), command
    for file in re.findall(r'(?:config|bags)/[^\s:]+', command):
        assert (REPOSITORY / file).exists(), file


# --- what there is -----------------------------------------------------------------------------


def test_parameters_and_options_are_listed() -> None:
    pytest.importorskip('sphinx', reason='the tables are made while the manual is built')
    sys.path.insert(0, str(DOCS / '_ext'))
    import reference

    assert reference.TABLES.keys() == {'slosh_node', 'rollover_node', 'vehicle_node'}
    for node, table in reference.TABLES.items():
        assert f'{{parameters}} {node}\n' in PAGES[f'reference/{node}.md']
        entries = [text.strip() for text in reference.parameter_list(node).split('\n\n')]
        for row in table:
            (entry,) = (text for text in entries if text.startswith(f'`{row.name}` ('))
            assert f': {row.meaning}' in entry
            assert row.kind in entry
            assert row.unit in entry
            assert row.constraints in entry
    names = reference.command_names()
    assert {'modes', 'check', 'replay', 'simulate', 'paper'} <= set(names)
    for name in names:
        assert f'{{command}} {name}\n' in PAGES['reference/commands.md']
    assert '| `--duration NUMBER` | ' in reference.command_table('replay')
    assert '| `BAG` | needed | ' in reference.command_table('replay')
    assert '| `--json` | ' in reference.command_table('modes')


def test_rooms_of_the_house_are_listed() -> None:
    told = re.findall(r'`(\w+)`', ' '.join(row[0] for row in rows('reference/layout.md')))
    assert sorted(told) == sorted(room for floor in HOUSE for room in floor)


def test_columns_are_listed() -> None:
    listed = ' '.join(row[0] for row in rows('reference/files.md', 'CSV of slosh replay'))
    totals = ' '.join(f'`total_{part}{axis}`' for part in 'fm' for axis in 'xyz')
    told = re.findall(r'`([^`]+)`', listed.replace('`total_fx` to `total_mz`', totals))
    assert told == [*COLUMNS.split(','), 'p_<point>', *ROLLOVER_COLUMNS.split(',')]


def test_columns_of_a_history_are_listed() -> None:
    history = Scenario.from_file(BRAKE).simulate(liquids_of(SloshConfig.from_file(BRAKE)), 0.05)
    columns = [
        re.sub('^fz_.*', 'fz_<axle><side>', re.sub('^beta_.*', 'beta_<mode>', name))
        for name in history.columns
    ]
    listed = ' '.join(row[0] for row in rows('reference/files.md', 'CSV of slosh simulate'))
    spelt = re.sub(r'`fz_\d[lr]`', '', listed)
    assert re.findall(r'`([^`]+)`', spelt) == list(dict.fromkeys(columns))


def test_verdicts_are_listed() -> None:
    told = [row[0] for row in rows('guide/diagnostics.md')]
    for verdict in Verdict:
        assert told.count(verdict.value) == 1, verdict


def test_limits_of_linear_theory_are_those_of_the_code() -> None:
    limits = [re.findall(r'[\d.]+', row[1]) for row in rows('theory/validity.md')[1:7]]
    assert [list(map(float, numbers)) for numbers in limits] == [
        [validity.WAVE_LIMIT, validity.WAVE_LIMIT_SHALLOW],
        [validity.SLOPE_LIMIT],
        [validity.SURFACE_CHANGE],
        [validity.RESONANCE_LIMIT],
        [1.0],
        [validity.SPIN_LIMIT],
    ]
    text = PAGES['theory/validity.md']
    assert f'shallowness: {validity.SHALLOW_LIMIT} over' in text
    assert f'below a depth of {validity.SHALLOW} of its length' in text


def test_arguments_of_launch_files_are_listed() -> None:
    told = {row[0].strip('`'): row[1] for row in rows('reference/topics.md', 'Launch files')[1:]}
    assert told.keys() == {f'{name}.launch.py' for name in ARGUMENTS}
    common = set(re.findall(r'`(\w+)`', told['slosh.launch.py']))
    for name, arguments in ARGUMENTS.items():
        text = told[f'{name}.launch.py']
        listed = set(re.findall(r'`(\w+)`', text)) | (common if 'those' in text else set())
        assert listed == arguments, name


# --- topics ------------------------------------------------------------------------------------

TANKS = """/**:
  ros__parameters:
    tanks: [{names}]
    front: {tank}
    rear: {tank}
    front.pressure.wall: [1.0, 0.0, -0.3]
"""
TANK = '{shape: rectangular, length: 2.0, width: 1.0, height: 1.0, fill_ratio: 0.5}'
VEHICLE = """/**/rollover_node:
  ros__parameters:
    vehicle:
      mass: 10000.0
      mass_centre: [0.0, 0.0, 0.0]
      roll_inertia: 9000.0
      base_height: 1.2
      track: 1.9
      roll_axis: 0.5
      roll_stiffness: 2.0e6
"""
ONE = TANKS.replace('    rear: {tank}\n', '').format(names='front', tank=TANK)
TWO = TANKS.format(names='front, rear', tank=TANK)
# parameter file and further arguments of each run that one needs to see all of a node
RUNS: dict[str, tuple[tuple[str, ...], ...]] = {
    'slosh_node': ((ONE,), (TWO, '-p', 'input.source:=twist')),
    'rollover_node': ((ONE + VEHICLE,),),
    'vehicle_node': (('/**: {ros__parameters: {vehicle: general}}',),),
}
_EVERY_NODE_HAS = re.compile(
    r'/rosout|/parameter_events|.*/(get|set|list|describe)_parameter.*|.*type_description'
)


def in_documentation(node: str) -> set[tuple[str, str, str]]:
    """Read direction, name and type of all that the page tells."""
    told = set()
    for name, kind, *_ in rows('reference/topics.md', node):
        if name in ('topic', 'service'):
            continue
        direction = 'in' if '(in)' in name else 'out'
        if '/srv/' in kind:
            direction = 'service'
        name = name.split('`')[1].replace('<point>', 'wall')
        name = name.replace('~', f'/{node}') if '~' in name else f'/{name.lstrip("/")}'
        names = [name.replace('<tank>', tank) for tank in ('front', 'rear')]
        told |= {(direction, name, kind) for name in names}
    return told


@pytest.mark.ros
@pytest.mark.parametrize('node', RUNS)
def test_topics_are_those_of_the_running_node(node: str, tmp_path: Path) -> None:
    rig = pytest.importorskip('ros_rig')
    seen: set[tuple[str, str, str]] = set()
    told = in_documentation(node)
    for k, (parameters, *options) in enumerate(RUNS[node]):
        file = tmp_path / f'{k}.yaml'
        file.write_text(parameters)
        files = ('--params-file', str(file))
        with (
            rig.NodeProcess(node, tmp_path / f'{k}.log', *files, *options) as process,
            rig.Driver() as driver,
        ):
            process.wait_for('ready')
            known, until = 0, time.monotonic() + 20.0
            while not told <= seen and time.monotonic() < until:
                driver.spin_for(0.2)
                if (found := in_graph(driver.node, node)) and found <= seen and known > 5:
                    break  # nothing new for a second
                known = 0 if found - seen else known + 1
                seen |= found
    assert {row for row in seen if not _EVERY_NODE_HAS.fullmatch(row[1])} == {
        row for row in told if not _EVERY_NODE_HAS.fullmatch(row[1])
    }


def in_graph(observer: object, node: str) -> set[tuple[str, str, str]]:
    """Ask DDS for direction, name and type of all that a node has."""
    found = set()
    if node not in observer.get_node_names():
        return found  # not discovered yet
    for direction, ask in (
        ('in', observer.get_subscriber_names_and_types_by_node),
        ('out', observer.get_publisher_names_and_types_by_node),
    ):
        found |= {(direction, name, kind) for name, kinds in ask(node, '/') for kind in kinds}
    for name, kinds in observer.get_service_names_and_types():  # of a hidden node's, too
        if name.startswith(f'/{node}/'):
            found |= {('service', name, kind) for kind in kinds}
    return found
