"""The `slosh` command: coefficients, checks, replay, simulation, the paper, without ROS."""

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Optional  # Typer 0.9 knows no X | None

import numpy as np
import typer
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.progress import Progress
from rich.table import Table

import slosh_ros
from slosh_ros.bag import MotionBag, Peaks, Recording, writer_for
from slosh_ros.bag import replay as replay_bag
from slosh_ros.bag.writer import LoadsWriter
from slosh_ros.constants import GRAVITY
from slosh_ros.engine import SloshConfig, SloshEngine, Verdict
from slosh_ros.engine.config import TankConfig
from slosh_ros.engine.convert import IMU, fill_topics, input_type
from slosh_ros.engine.fill import LiveFill
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.hydro.added_mass_tank import AddedMassTank
from slosh_ros.hydro.fill_table import FILL_RANGE
from slosh_ros.monitor import RolloverMonitor
from slosh_ros.parameters import names_node
from slosh_ros.study import fits
from slosh_ros.study.tables import summary, write_history
from slosh_ros.study.tanks import liquids_of
from slosh_ros.vehicle import (
    Drive,
    GeneralTruck,
    History,
    SloshingCargo,
    Thresholds,
    Warn,
)
from slosh_ros.vehicle.rollover import RollVehicle
from slosh_ros.vehicle.scenario import Scenario

app = typer.Typer(
    help='Sloshing loads of partly filled tanks.',
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
_WIDTH = 110  # of what is printed, at least
_WIDEST = 1000  # that a table may be
_out = Console(width=max(_WIDTH, Console().width), highlight=False, emoji=False)
_err = Console(stderr=True, soft_wrap=True, highlight=False, emoji=False)

_WARNINGS = {
    'contact': 'contact is lost at {w.first:.2f} s: wheel {where} down to {load:.1f} kN, '
    '{w.share:.0%} of the time; the linear springs hold it to the road',
    'liquid': 'linear theory is left at {w.first:.2f} s, {w.share:.0%} of the time: {where} '
    'up to {w.worst:.2g}, limit {w.limit:.2g}',
    'articulation': 'small articulation is left at {w.first:.2f} s: up to {w.worst:.2f} rad, '
    '{w.share:.0%} of the time',
}
_SMALL = 1e-9  # products of inertia that are rounding
_MOST_FILLS = 1000  # of a sweep
_COLUMNS = 8  # modes side by side
_LAMBDAS = {1: 'kg', 2: 'kg', 4: 'kg m', 5: 'kg m', 6: 'kg m'}

ConfigFile = Annotated[Path, typer.Argument(metavar='CONFIG', help='ROS 2 parameter file.')]


@app.callback(invoke_without_command=True)
def slosh(
    version: Annotated[bool, typer.Option('--version', help='Print the version.')] = False,
) -> None:
    """Sloshing loads of partly filled tanks."""
    if version:
        print(slosh_ros.__version__)
        raise typer.Exit


@app.command()
def modes(
    config: ConfigFile,
    tank: Annotated[Optional[str], typer.Option(help='Name of one of several tanks.')] = None,
    fill: Annotated[
        Optional[str],
        typer.Option(
            metavar='R|A:B:N', help='Fill ratio in place of the one in CONFIG; or N from A to B.'
        ),
    ] = None,
    side_by_side: Annotated[
        bool,
        typer.Option('--compare', help='Solve by every route that applies, side by side.'),
    ] = False,
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON.')] = False,
    plot: Annotated[
        Optional[Path],
        typer.Option(
            help='Draw the surface shapes, or what changes with the fill: PNG, SVG, PDF.'
        ),
    ] = None,
) -> None:
    """Print the modal coefficients of a tank, at one fill or over the fill."""
    chosen = _one_tank(SloshConfig.from_file(config), config, tank)
    if side_by_side and ((fill is not None and ':' in fill) or plot is not None):
        raise InputError('--compare is of one fill and draws nothing; leave out A:B:N and --plot')
    if fill is not None and ':' in fill:
        _sweep(chosen, _fills(fill), as_json, plot)
        return
    chosen = _with_fill(chosen, fill)
    if side_by_side:
        _compare(chosen, as_json)
        return
    coefficients = chosen.coefficients()
    if as_json:
        print(json.dumps(_as_json(chosen, coefficients), indent=2))
    else:
        _print_modes(chosen, coefficients)
    if plot is not None:
        from slosh_ros.study.plots import plot_modes

        plot_modes(chosen.name, coefficients, plot)


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(metavar='FILE...', help='Parameter files.')],
) -> None:
    """Check parameter files as the node would."""
    problems = []
    for file in files:
        try:
            print(f'{file}: good: {_checked(file)}')
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError('\n       '.join(problems))


@app.command()
def replay(
    bag: Annotated[Path, typer.Argument(metavar='BAG', help='ROS 2 or ROS 1 bag.')],
    config: Annotated[Path, typer.Option(help='ROS 2 parameter file.')],
    imu: Annotated[Optional[str], typer.Option(help='Topic of the Imu.')] = None,
    twist: Annotated[Optional[str], typer.Option(help='Topic of the Twist.')] = None,
    fill: Annotated[
        Optional[list[str]],
        typer.Option(
            metavar='[TANK=]TOPIC',
            help='Topic of the fill, if it is not called as that of slosh_node; may be repeated.',
        ),
    ] = None,
    out: Annotated[Optional[Path], typer.Option(help='Write the loads: .csv or .mcap.')] = None,
    plot: Annotated[Optional[Path], typer.Option(help='Draw the loads: PNG, SVG, PDF.')] = None,
    animate: Annotated[
        Optional[Path], typer.Option(help='Show the liquid in motion: GIF, MP4.')
    ] = None,
    start: Annotated[float, typer.Option(help='Leave out the first seconds.', min=0.0)] = 0.0,
    duration: Annotated[
        Optional[float], typer.Option(help='Replay so many seconds.', min=0.0)
    ] = None,
    rollover: Annotated[
        Optional[Path],
        typer.Option(help='Judge the vehicle of this file: load transfer, rollover margin.'),
    ] = None,
) -> None:
    """Replay a recorded drive: the node's own numbers, without ROS."""
    settings = SloshConfig.from_file(config)
    if imu is not None and twist is not None:
        raise InputError('--imu and --twist are both given; choose one input')
    if imu is not None or twist is not None:
        settings = replace(settings, source='imu' if twist is None else 'twist')
    for path in (out, plot, animate):
        _keep_bag(bag, path)
    if animate is not None:
        from slosh_ros.study.animation import check_target

        check_target(animate)
    engine = SloshEngine(settings)
    monitor = None if rollover is None else _monitor(engine, config, rollover)
    kind = input_type(engine)
    topic, default = (imu, '/imu/data') if kind == IMU else (twist, '/twist')
    peaks, recording = Peaks(engine), Recording(engine)
    fills = _fill_topics(engine, fill or [])
    with MotionBag(bag, kind, topic, default, start, duration, fills) as source:
        writers: list[LoadsWriter] = [peaks]
        if plot is not None or animate is not None:
            writers.append(recording)
        if out is not None:
            writers.append(writer_for(out, settings, monitor is not None))
        begin, end = source.span
        with _progress(f'replaying {source.topic}', end - begin) as advance:
            count = replay_bag(source, engine, writers, lambda now: advance(now - begin), monitor)
        followed = source.fill_topics
    _print_replay(peaks, engine, source.topic, count)
    for name, told in followed.items():
        _out.print(
            f'{name} is filled as {told} tells, in the end to {engine.fill_ratio(name):.1%}'
        )
    if monitor is not None:
        _print_rollover(peaks, monitor)
    if plot is not None:
        from slosh_ros.study.plots import plot_replay

        plot_replay(recording, f'{bag.name}: {source.topic}', plot)
    if animate is not None:
        from slosh_ros.study.animation import animate_replay

        with _progress(f'drawing {animate}', peaks.span) as advance:
            animate_replay(recording, engine, bag.name, animate, advance)


@app.command()
def simulate(
    scenario: Annotated[
        Path, typer.Argument(metavar='SCENARIO', help='Parameter file of vehicle and tanks.')
    ],
    out: Annotated[Optional[Path], typer.Option(help='Write the history: .csv.')] = None,
    plot: Annotated[Optional[Path], typer.Option(help='Draw the history: PNG, SVG, PDF.')] = None,
    animate: Annotated[
        Optional[Path], typer.Option(help='Show truck and liquid in motion: GIF, MP4.')
    ] = None,
    compare: Annotated[
        bool,
        typer.Option(
            '--compare',
            help='Set it beside the solid cargo, and Table 4 beside the exact coefficients or '
            'the exact inertia of the liquid beside the frozen one.',
        ),
    ] = False,
) -> None:
    """Drive a truck with its liquid, solved as one system in one process."""
    drive = Scenario.from_file(scenario)
    if animate is not None:
        from slosh_ros.study.animation import check_target

        check_target(animate)
    variants = drive.variants if compare else {drive.label: drive}
    tank_needed = animate is not None and not drive.table_4
    if tank_needed or any(not (v.solid or v.table_4) for v in variants.values()):
        tanks = liquids_of(SloshConfig.from_file(scenario))
    else:
        tanks = []
    duration = drive.steps * drive.step_ns * 1e-9
    histories = {}
    for name, variant in variants.items():
        with _progress(f'driving: {name}', duration) as advance:
            histories[name] = variant.simulate(tanks, progress=advance)
    if out is not None:
        write_history(histories[drive.label], out)
    _print_histories(histories)
    if isinstance(drive.plan, Drive):
        liquid = next((v for v in variants.values() if not v.solid), drive)
        _print_thresholds(drive.plan.truck, liquid.sloshing(tanks))
    if plot is not None:
        from slosh_ros.study.plots import plot_histories

        plot_histories(histories, scenario.stem, plot)
    if animate is not None:
        from slosh_ros.study.animation import animate_history

        with _progress(f'drawing {animate}', duration) as advance:
            animate_history(drive, tanks, histories[drive.label], scenario.stem, animate, advance)


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help='Folder of the report.')] = Path('paper_report'),
    only: Annotated[
        Optional[list[str]], typer.Option(help='One item of the report, fig6; may be repeated.')
    ] = None,
) -> None:
    """Recompute the paper and the experiments: HTML, Markdown, JSON, pictures, numbers."""
    from slosh_ros.study.paper import Verdict, chosen, reproduce, write_report  # with matplotlib

    names = only or []
    with _steps([item.title for item in chosen(names)]) as tell:
        found = list(reproduce(names, tell))
    write_report(found, out)
    table = _table('item', *(verdict.name.lower() for verdict in Verdict))
    for item, finding in found:
        verdicts = [row.verdict for row in finding.rows]
        table.add_row(item.name, *(str(verdicts.count(v) or '') for v in Verdict))
    _print_table(table)
    for name in ('index.html', 'report.md', 'paper.json'):
        _out.print(f'{out / name}', soft_wrap=True)


def main() -> None:
    """Run the command; bad input ends in one clear message and exit code 1."""
    try:
        app()
    except InputError as error:
        _err.print(f'[bold red]error:[/] {_plain(str(error))}')
        sys.exit(1)


def _table(*heads: str) -> Table:
    """Make a table whose heads carry their units on a second line."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in heads:
        table.add_column(_plain(head.replace(' [', '\n[')), justify='right', no_wrap=True)
    return table


def _print_table(table: Table) -> None:
    """Print a table in full; a narrow terminal wraps it rather than cut its numbers."""
    needs = Measurement.get(_out, _out.options.update(max_width=_WIDEST), table).maximum
    Console(width=max(_out.width, needs)).print(table)


def _checked(file: Path) -> str:
    """Do with a parameter file what the nodes do with it, and tell what it holds."""
    if names_node(file, 'rollover_node'):
        return f'vehicle of {RollVehicle.from_file(file).mass:.0f} kg with empty tanks'
    config = SloshConfig.from_file(file)
    try:
        engine = SloshEngine(config)
    except InputError as error:
        raise InputError(f'{file}: {error}') from error
    if names_node(file, 'vehicle_node'):
        Scenario.from_file(file)
    tanks = (tank.config for tank in engine.tanks)
    return ', '.join(f'{t.name} ({"; ".join([_told(t), *t.tank.repairs])})' for t in tanks)


def _told(tank: TankConfig) -> str:
    return f'{tank.tank.shape}, {tank.tank.fill_ratio(tank.depth):.1%} full'


def _keep_bag(bag: Path, path: Path | None) -> None:
    """Refuse to write over a recording or into its folder."""
    if path is not None and (
        bag.resolve() in path.resolve().parents or bag.resolve() == path.resolve()
    ):
        raise InputError(f'{path}: lies in the bag {bag}; write elsewhere')


def _plain(text: str) -> str:
    return text.replace('[', r'\[')


def _fill_topics(
    engine: SloshEngine, given: Sequence[str]
) -> dict[str, tuple[Optional[str], str]]:
    """Topic of each tank's fill that was given, and how slosh_node would call it."""
    usual = fill_topics(engine)
    chosen: dict[str, str] = {}
    for text in given:
        name, _, topic = text.rpartition('=')
        name = name or next(iter(usual))
        if (
            name not in usual
            or not topic
            or name in chosen
            or (len(usual) > 1 and '=' not in text)
        ):
            raise InputError(
                f'--fill is {text}; it must be the topic of the fill, with several tanks after '
                f'the name of one and =, once each; there is {", ".join(usual)}'
            )
        chosen[name] = topic
    return {name: (chosen.get(name), f'slosh_node/{topic}') for name, topic in usual.items()}


def _one_tank(settings: SloshConfig, path: Path, name: str | None) -> TankConfig:
    names = [tank.name for tank in settings.tanks]
    if name is None and len(names) > 1:
        raise InputError(f'{path}: has the tanks {", ".join(names)}; choose one with --tank')
    if name is not None and name not in names:
        raise InputError(f'{path}: has no tank {name}; it has {", ".join(names)}')
    return settings.tanks[names.index(name) if name else 0]


def _print_histories(histories: Mapping[str, History]) -> None:
    """Print the figures of variants side by side, and what takes them out of their theory."""
    table = _table('largest', *histories, 'unit')
    figures = [summary(history) for history in histories.values()]
    for name, unit in figures[0]:
        values = [_shown(f[name, unit]) for f in figures]
        if set(values) != {'0.000'}:  # nothing there in this drive
            table.add_row(name, *values, unit)
    _print_table(table)
    for name, history in histories.items():
        told = f'{name}: ' if len(histories) > 1 else ''
        for warning, where in _gathered(history.warnings):
            text = _WARNINGS[warning.kind].format(w=warning, where=where, load=warning.worst / 1e3)
            _out.print(f'[yellow]{told}{text}[/]')


def _shown(value: float) -> str:
    """Show a figure; what never happens as a dash, what is not known as a question mark."""
    if np.isnan(value):
        return '?'
    return f'{value:.3f}' if np.isfinite(value) else '-'


def _gathered(warnings: Iterable[Warn]) -> list[tuple[Warn, str]]:
    """Tell wheels of one fate once: left and right ones, where nothing leans."""
    wheels: dict[Warn, list[str]] = {}
    for warning in warnings:
        wheels.setdefault(replace(warning, where=''), []).append(warning.where)
    return [(warning, ', '.join(where)) for warning, where in wheels.items()]


def _print_thresholds(truck: GeneralTruck, cargo: SloshingCargo) -> None:
    """Print the lateral accelerations at which the truck rolls over in a steady turn."""
    t = Thresholds.of(truck, cargo)
    cargoes = {'solid cargo': (t.rigid_frozen, t.frozen, t.lift_off_frozen)}
    if cargo.tanks:
        cargoes = {'liquid cargo': (t.rigid_liquid, t.liquid, t.lift_off_liquid), **cargoes}
    table = _table('rolls over at', *(f'{name} [{u}]' for name in cargoes for u in ('m/s^2', 'g')))
    names = ('rigid truck', 'truck on its springs', 'first wheel lifts off')
    for name, *values in zip(names, *cargoes.values(), strict=True):
        table.add_row(name, *(f'{x:.3f}' for a in values for x in (a, a / GRAVITY)))
    _print_table(table)


def _ratio(text: str, wanted: str) -> float:
    """Read a fill ratio."""
    try:
        ratio = float(text)
    except ValueError:
        ratio = float('nan')
    if not 0.0 <= ratio <= 1.0:
        raise InputError(f'--fill is {text}; it must be {wanted}')
    return ratio


def _fills(text: str) -> list[float]:
    """Read A:B:N."""
    begin, _, rest = text.partition(':')
    end, _, count = rest.partition(':')
    if not count.isdecimal() or not 2 <= int(count) <= _MOST_FILLS:
        raise InputError(
            f'--fill is {text}; a sweep is A:B:N, N fills from A to B, 2 to {_MOST_FILLS}'
        )
    first, last = (_ratio(number, 'a ratio from 0 to 1') for number in (begin, end))
    return [round(x, 12) for x in np.linspace(first, last, int(count)).tolist()]


def _with_fill(tank: TankConfig, text: str | None) -> TankConfig:
    if text is None:
        return tank
    low, high = FILL_RANGE
    wanted = f'a ratio from {low:g} to {high:g}, or 0, or 1'
    ratio = _ratio(text, wanted)
    if not (low <= ratio <= high or ratio in (0.0, 1.0)):
        raise InputError(f'--fill is {text}; it must be {wanted}')
    try:
        return replace(tank, depth=tank.tank.depth(ratio))
    except InputError as error:
        raise InputError(f'--fill is {text}, but {tank.name}: {error}') from error


def _sweep(tank: TankConfig, ratios: list[float], as_json: bool, plot: Path | None) -> None:
    """Tell how the same modes change with the fill."""
    fill = LiveFill(tank, tank.coefficients())
    with _progress(f'filling {tank.name}', len(ratios)) as advance:
        found = []
        for i, ratio in enumerate(ratios):
            try:
                found.append(fill.solved(ratio))
            except InputError as error:
                raise InputError(f'{tank.name}, filled to {ratio:.2%}: {error}') from error
            advance(i + 1)
    if as_json:
        rows = zip(ratios, found, strict=True)
        print(json.dumps([{'fill_ratio': r, **_as_json(tank, c)} for r, c in rows], indent=2))
    else:
        _print_sweep(tank, ratios, found)
    if plot is not None:
        from slosh_ros.study.plots import plot_sweep

        plot_sweep(tank.name, found, plot)


def _print_sweep(
    tank: TankConfig, ratios: list[float], found: Sequence[ModalCoefficients]
) -> None:
    _out.print(f'[bold]{tank.name}[/]: {tank.tank.shape}, {tank.density:g} kg/m^3')
    turns = [f'J0 {turn} [kg m^2]' for turn in ('roll', 'pitch', 'yaw')]
    table = _table('fill [%]', 'depth [m]', 'mass [kg]', 'z of O [m]', *turns)
    for ratio, c in zip(ratios, found, strict=True):
        table.add_row(
            f'{ratio:.2%}'.rstrip('%'),
            f'{c.liquid.depth:.4f}',
            f'{c.mass:.1f}',
            f'{c.liquid.surface_height:+.4f}',
            *(f'{j:.6g}' for j in np.diag(c.inertia_stokes_joukowski)),
        )
    _out.print('under a closed lid about O, the centre of the mean free surface')
    _print_table(table)
    names = list(dict.fromkeys(name for c in found for name in c.names))
    for what, unit, digits, told in (
        ('natural frequency', 'rad/s', '.4f', [c.omega for c in found]),
        ('mass that the mode moves', 'kg', '.1f', [c.mass_moved for c in found]),
        ('its height above O', 'm', '+.4f', [c.lever for c in found]),
    ):
        rows = [dict(zip(c.names, row, strict=True)) for c, row in zip(found, told, strict=True)]
        for first in range(0, len(names), _COLUMNS):
            shown = names[first : first + _COLUMNS]
            table = _table('fill [%]', *(f'{name} [{unit}]' for name in shown))
            for ratio, row in zip(ratios, rows, strict=True):
                values = [row.get(name, np.nan) for name in shown]
                table.add_row(
                    f'{ratio:.2%}'.rstrip('%'),
                    *('-' if np.isnan(v) else format(v, digits) for v in values),
                )
            _out.print(f'{what} [{unit}]'.replace('[', r'\['))
            _print_table(table)


def _as_json(tank: TankConfig, c: ModalCoefficients) -> dict[str, object]:
    damping = tank.damping_of(c)
    fit: dict[str, object] = (
        {'fit': fits.as_json(tank.tank)} if isinstance(tank.tank, AddedMassTank) else {}
    )
    return {
        'tank': tank.name,
        'route': c.route,
        'mass': c.mass,
        'volume': c.liquid.volume,
        'surface_height': c.liquid.surface_height,
        'surface_centre': c.liquid.surface_centre.tolist(),
        'centroid': c.liquid.centroid.tolist(),
        'inertia_frozen': c.inertia_frozen.tolist(),
        'inertia_stokes_joukowski': c.inertia_stokes_joukowski.tolist(),
        'error': c.error,
        'damping': damping.source,
        'damping_holds': damping.holds,
        'damping_beyond': list(damping.beyond),
        'modes': [
            {
                'name': name,
                'omega': float(c.omega[j]),
                'mu': float(c.mu[j]),
                'lambda': c.coupling[j].tolist(),
                'damping_ratio': float(damping.ratio[j]),
            }
            for j, name in enumerate(c.names)
        ],
        **fit,
    }


def _compare(tank: TankConfig, as_json: bool) -> None:
    """Print what all routes give, and how far they are from the tank's own."""
    try:
        from slosh_ros.study.compare import compare  # with all routes

        routes = compare(tank.tank, tank.depth, tank.density)
    except InputError as error:
        raise InputError(f'{tank.name}: {error}') from error
    own, *others = routes
    if as_json:
        print(
            json.dumps({'tank': tank.name, 'routes': [r.as_json(own) for r in routes]}, indent=2)
        )
        return
    found = [route for route in routes if route.values]
    heads = [route.name.replace(' ', '\n') for route in found]
    values = _table(tank.name, *heads, 'unit')
    apart = _table('difference [%]', *heads[1:])
    for quantity in own.values:
        here = [route.values.get(quantity) for route in found]
        values.add_row(
            quantity.name, *('' if v is None else f'{v:.6g}' for v in here), quantity.unit
        )
        off = [route.differences(own).get(quantity) for route in found[1:]]
        apart.add_row(quantity.name, *('' if d is None else f'{100.0 * d:+.3g}' for d in off))
    _print_table(values)
    if len(found) == 1:
        _out.print('there is no other route to this liquid')
    else:
        _print_table(apart)
    for route in others:
        _out.print(_plain(route.verdict(own)))


def _place(point: NDArray[np.float64]) -> str:
    """Write a point by its z, and its x and y where they are not 0."""
    aside = [
        f'{axis} = {c:+.4f} m, ' for axis, c in zip('xy', point[:2], strict=True) if round(c, 4)
    ]
    return ''.join(aside) + f'z = {point[2]:+.4f} m'


def _print_modes(tank: TankConfig, c: ModalCoefficients) -> None:
    damping = tank.damping_of(c)
    liquid = c.liquid
    _out.print(
        f'[bold]{tank.name}[/]: {tank.tank.shape}, {liquid.fill_ratio:.1%} full, '
        f'{liquid.depth:.3f} m deep, {c.mass:.1f} kg at {c.density:g} kg/m^3 ({c.route})'
    )
    _out.print(
        f'mean free surface O at {_place(liquid.surface_centre)} in the tank frame\n'
        f'centroid at {_place(liquid.centroid)} from O'
    )
    for repair in tank.tank.repairs:
        _out.print(f'{tank.name}.mesh_file: {repair}')
    turns = {'roll': (0, 0), 'pitch': (1, 1), 'yaw': (2, 2)}
    products = {'roll-pitch': (0, 1), 'roll-yaw': (0, 2), 'pitch-yaw': (1, 2)}
    small = _SMALL * float(np.abs(c.inertia_frozen).max())
    turns |= {name: at for name, at in products.items() if abs(c.inertia_frozen[at]) > small}
    inertia = _table('inertia about O', *(f'{k} [kg m^2]' for k in turns))
    for name, tensor in (
        ('frozen', c.inertia_frozen),
        ('Stokes-Joukowski', c.inertia_stokes_joukowski),
    ):
        inertia.add_row(name, *(f'{tensor[i]:.6g}' for i in turns.values()))
    _print_table(inertia)

    if not c.names:
        _out.print('nothing sloshes in an empty tank, nor in a full one')
        return
    lambdas = [f'lambda_{k} [{unit}]' for k, unit in _LAMBDAS.items()]
    table = _table('mode', 'omega [rad/s]', 'period [s]', 'damping', 'mu [kg]', *lambdas)
    least = _SMALL * np.abs(c.coupling).max(axis=0)
    for j, (name, row) in enumerate(zip(c.names, c.coupling, strict=True)):
        table.add_row(
            name,
            f'{c.omega[j]:.5f}',
            f'{2.0 * np.pi / c.omega[j]:.3f}',
            f'{damping.ratio[j]:.3g}',
            f'{c.mu[j]:.6g}',
            *(f'{row[k - 1]:.6g}' if abs(row[k - 1]) > least[k - 1] else '-' for k in _LAMBDAS),
        )
    _print_table(table)
    surge, sway = (c.coupling[:, :2] ** 2 / c.mu[:, None]).sum(axis=0) / c.mass
    _out.print(
        f'share of the mass that these modes move: {surge:.1%} fore-aft, {sway:.1%} sideways\n'
        f'damping: {_plain(damping.words)}'
    )
    if c.error is not None:
        if c.route == 'added mass':
            of = ', of the fit: what the data are off comes on top'
        else:
            of = ', of lambda over the largest of its kind'
        _out.print(f'largest relative error of omega and lambda, estimated: {c.error:.1g}{of}')
    for beyond in damping.beyond:
        _out.print(f'[yellow]damping beyond its range: {_plain(beyond)}[/]')
    if isinstance(tank.tank, AddedMassTank):
        _print_fit(tank.tank)


def _print_fit(tank: AddedMassTank) -> None:
    """Print what was read and fitted, with the standard errors of the fit."""
    heads = ('omega [rad/s]', 'modal mass [kg, kg m^2]', 'lever from O [m]')
    table = _table('fitted', *(h for head in heads for h in (head, '+-')))
    for name, fitted, n in fits.rows(tank):
        table.add_row(
            name,
            f'{fitted.omega[n]:.5f}',
            f'{fitted.omega_error[n]:.1g}',
            f'{fitted.modal_mass[n]:.6g}',
            f'{fitted.modal_mass_error[n]:.1g}',
            f'{fitted.lever[n]:.4f}' if fitted.lever[n] else '-',
            f'{fitted.lever_error[n]:.1g}' if fitted.lever[n] else '-',
        )
    _print_table(table)
    for line in fits.told(tank):
        _out.print(_plain(line))


def _print_replay(peaks: Peaks, engine: SloshEngine, topic: str, count: int) -> None:
    frame = engine.config.output_frame
    _out.print(f'{count} samples of {topic} over {peaks.span:.2f} s, loads in {frame}')
    table = _table('largest', 'sloshing', 'total', 'unit')
    names = [f'force {axis}' for axis in 'xyz'] + [f'moment {axis}' for axis in 'xyz']
    for k, name in enumerate(names):
        unit = 'kN' if k < 3 else 'kN m'
        table.add_row(name, f'{peaks.wrench[k] / 1e3:.3f}', f'{peaks.total[k] / 1e3:.3f}', unit)
    table.add_row('wave height', f'{peaks.elevation_max:.3f}', '', 'm')
    for point, pressure in zip(engine.config.pressure_points, peaks.pressure, strict=True):
        table.add_row(f'pressure {point}', '', f'{pressure / 1e3:.3f}', 'kPa')
    _print_table(table)
    for verdict, number in engine.gate.counts.items():
        if verdict not in (Verdict.ACCEPTED, Verdict.STARTED):
            _out.print(f'{number} {verdict.value}')
    for warning, number in engine.warnings.items():
        _out.print(f'[yellow]{number} x {_plain(warning)}[/]')
    for beyond, worst in peaks.beyond.values():
        _out.print(
            f'[yellow]{beyond} of {count} samples ({beyond / count:.1%}) leave linear theory, so '
            f'take their loads with care (column valid): at worst, {worst}[/]'
        )


def _monitor(engine: SloshEngine, config: Path, vehicle: Path) -> RolloverMonitor:
    try:
        return RolloverMonitor(engine, RollVehicle.from_file(vehicle))
    except InputError as error:
        told = str(error)
        named = told.startswith(f'{vehicle}: ')
        raise InputError(told if named else f'{config} with {vehicle}: {told}') from error


def _print_rollover(peaks: Peaks, monitor: RolloverMonitor) -> None:
    least, largest = peaks.load_transfer_ratio
    balance = monitor.balance
    _out.print(
        f'load transfer ratio from {least:+.3f} to {largest:+.3f}, '
        f'least rollover margin {peaks.least_margin:.3f} g; in a steady turn the vehicle rolls '
        f'over at {balance.threshold_liquid / GRAVITY:.3f} g, with a solid load at '
        f'{balance.threshold_solid / GRAVITY:.3f} g'
    )


@contextmanager
def _progress(what: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show on a terminal how much of a total is done."""
    if not _err.is_terminal:
        yield lambda _: None
        return
    with Progress(console=_err, transient=True) as bar:
        task = bar.add_task(_plain(what), total=total)
        shown = 0.0

        def advance(done: float) -> None:
            nonlocal shown
            if done - shown > total / 200.0:
                shown = done
                bar.update(task, completed=done)

        yield advance


@contextmanager
def _steps(titles: list[str]) -> Iterator[Callable[[str], None]]:
    if not _err.is_terminal:
        yield lambda _: None
        return
    with Progress(console=_err, transient=True) as bar:
        task = bar.add_task('', total=len(titles))
        yield lambda title: bar.update(task, description=title, completed=titles.index(title))


if __name__ == '__main__':
    main()
