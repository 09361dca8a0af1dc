# ruff: noqa: E501 (a table of messages is read along its lines)
"""Bad input: one clear message that names the input and the remedy, exit code 1, no traceback."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest import mock

import pytest
from drives import stamps, write_bag
from test_replay import brake, slosh

from slosh_ros.cli import main

GOOD = """/**:
  ros__parameters:
    tank:
      shape: rectangular
      length: 8.0
      width: 2.0
      height: 1.6
      fill_ratio: 0.5
"""
BOX = """shape: rectangular
      length: 8.0
      width: 2.0
      height: 1.6"""
assert BOX in GOOD


@pytest.mark.parametrize(
    ('change', 'says'),
    [
        (('length: 8.0', 'length: 8'), 'tank.length has the integer 8 where ROS 2 wants a double; write 8.0 [m]'),
        (('length: 8.0', 'length: long'), "tank.length has the text 'long' where a number is wanted [m]"),
        (('length: 8.0', 'length: -8.0'), 'tank.length is -8 [m]; it must be from 1e-06 to 200 m'),
        (('length: 8.0', 'length: .nan'), 'tank.length is nan [m]; it must be'),
        (('length: 8.0', 'length: 8000.0'), 'tank.length is 8000 [m]; it must be from'),
        (('length: 8.0', 'length: 0.008'), 'tank.length is 0.008 m; a tank has 0.01 to 200 m: write metres'),
        (('width: 2.0', 'width: 0.002'), 'tank.width is 0.002 [m]; it must be from 0.01 to 200 m'),
        (('height: 1.6', 'height: 1600.0'), 'tank.height is 1600 [m]; it must be from 0.01 to 200 m'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 0.0, 900.0, 0.0, 0.0, 700.0]'), 'tank.points span 900 m in width; a tank has 0.01 to 200 m: write metres'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 0.0, 0.02, 0.0, 0.0, 0.002]'), 'tank.points span 0.002 m in height'),
        ((BOX, 'shape: sphere\n      radius: 950.0'), 'tank.radius is 950 [m]; it must be from 0.005 to 100 m'),
        (('length: 8.0', 'lenght: 8.0'), 'tank.lenght is not a parameter; did you mean tank.length?'),
        (('length: 8.0', 'length: 8.0\n      length: 9.0'), 'found duplicate key "length"'),
        (('length: 8.0', ''), 'tank.length is missing; a rectangular tank needs length, width, height'),
        (('length: 8.0', 'length: 8.0\n      radius: 1.0'), 'tank.radius is given, but a rectangular tank takes'),
        (('fill_ratio: 0.5', 'fill_ratio: 0.5\n      fill_depth: 0.8'), 'tank.fill_ratio and tank.fill_depth are both given; give exactly one'),
        (('fill_ratio: 0.5', ''), 'tank.fill_ratio and tank.fill_depth are both missing; give exactly one'),
        (('fill_ratio: 0.5', 'fill_ratio: 1.5'), 'tank.fill_ratio is 1.5; it must be from 0 to 1'),
        (('fill_ratio: 0.5', 'fill_ratio: 0.001'), 'tank.fill_ratio fills 0.10% of the tank; it must fill from 1% to 99%'),
        (('fill_ratio: 0.5', 'fill_depth: 2.0'), 'tank.fill_depth is 2 m; the tank is 1.6 m high'),
        (('shape: rectangular', 'shape: rectangle'), '; did you mean rectangular?'),
        (('shape: rectangular', ''), 'tank.shape is missing'),
        (('    tank:', '    tank.width: 3.0\n    tank:'), 'gives tank.width twice'),
        (('    tank:', '    tanks: [front]\n    tank:'), 'tank.shape is not a parameter'),
        (('    tank:', '    tanks: []\n    tank:'), 'tanks is []; it takes a list of texts, at least one'),
        (('    tank:', "    tanks: ['[/x]']\n    tank:"), "tanks has the name '[/x]'; a name has letters"),
        (('    tank:', '    tanks: [imu]\n    tank:'), "tanks has the name 'imu'"),
        (('    tank:', '    imu:\n      rpy: [0.0, 90.0, 0.0]\n    tank:'), 'imu.rpy is 90 [rad]; it must be from'),
        (('    tank:', '    imu:\n      xyz: [0.0, 1.0e+300, 0.0]\n    tank:'), 'imu.xyz is 1e+300 [m]'),
        (('length: 8.0', 'length: &l 8.0\n      width: *l'), 'has an alias (*name)'),
        (('    tank:', '    tanks: [tank, tank]\n    tank:'), 'tanks names tank more than once'),
        (('    tank:', '    imu:\n      xyz: [0, 0, 1]\n    tank:'), 'imu.xyz has the integer 0 where ROS 2 wants a double; write 0.0 [m]'),
        (('    tank:', '    imu:\n      xyz: [0.0, 1.0]\n    tank:'), 'imu.xyz has 2 numbers; it takes 3 [m]'),
        (('    tank:', '    input:\n      source: gps\n    tank:'), "input.source is 'gps'; it must be one of imu, twist"),
        (('fill_ratio: 0.5', 'fill_ratio: 0.5\n      modes: 2.0'), 'tank.modes is 2.0; it takes an integer'),
        (('fill_ratio: 0.5', 'fill_ratio: 0.5\n      modes: 3\n      damping_ratio: [0.1, 0.2]'), 'tank.damping_ratio has 2 numbers for 3 modes'),
        (('  ros__parameters:', '  parameters:'), "has no 'ros__parameters:' with entries under '/**:'"),
        (('/**:', 'other_node:'), 'is not a parameter file for slosh_node'),
        (('/**:', '/**: ['), 'is not valid YAML'),
        (('length: 8.0', '[1, [2]]: 8.0'), 'has a list or a mapping as a key, where a name is wanted'),
        (('length: 8.0', 'length:\n        ' + '- ' * 1200), 'is nested too deeply'),
        (('length: 8.0', 'length: x' + 5000 * '9'), '9999 ... where a number is wanted [m]'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0]'), 'tank.points has edges that cross or touch: from corner 1 (0, 0) to 2 and from corner 3 (1, 0) to 4'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 0.0, 1.0, 0.0, 1.0]'), 'tank.points has 5 numbers; it takes pairs'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 0.0, 2400.0, 0.0, 0.0, 1700.0]'), 'tank.points is 2400 [m]; it must be from -1000 to 1000 m'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0, 0, 1, 0, 0, 1]'), 'tank.points has the integer 0 where ROS 2 wants a double'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: 1.0'), 'tank.points is 1.0; it takes a list of numbers'),
        ((BOX, 'shape: section_x\n      length: 8.0\n      points: [0.0, 2.0, 1.0, 0.0, 2.0, 1.9, 3.0, 0.0, 4.0, 2.0]'), 'tank: filled to 50.00%, 1.41331 m deep, the section has 2 pools'),
        ((BOX, BOX.replace('rectangular', 'rounded_rectangle_x') + '\n      corner_radius: 1.0'), 'tank.corner_radius is 1 m; a section 2 m wide and 1.6 m high has room for 0 to 0.8 m'),
        ((BOX, BOX.replace('rectangular', 'ellipse_x') + '\n      radius: 1.0'), 'tank.radius is given, but'),
        ((BOX, 'shape: sphere\n      radius: 0.0'), 'tank.radius is 0 [m]; it must be from 0.005'),
        ((BOX, 'shape: sphere\n      radius: 1.0\n      length: 2.0'), 'tank.length is given, but a sphere tank takes radius; remove it'),
        ((BOX, 'shape: cylinder_x\n      radius: 1.0\n      length: 4.0\n      head_depth: 1.5'), 'tank.head_depth is 1.5 m; it must lie between 0, flat ends, and the radius of 1 m'),
        ((BOX, 'shape: mesh'), 'tank.mesh_file is missing; a mesh tank needs mesh_file'),
        ((BOX, 'shape: mesh\n      mesh_file: nowhere.stl'), 'nowhere.stl, but there is no such file'),
        ((BOX, 'shape: mesh\n      mesh_file: [1.0]'), 'tank.mesh_file is [1.0]; it takes the name'),
        ((BOX, 'shape: mesh\n      mesh_file: tank.stl\n      mesh_scale: 0.0'), 'tank.mesh_scale is 0 [m]; it must be from 1e-06'),
        ((BOX, BOX.replace('rectangular', 'ellipse_x').replace('1.6', '0.0')), 'tank.height is 0 [m]; it must be from 0.01'),
    ],
)  # fmt: skip
def test_bad_parameter_file(tmp_path, change, says):
    file = tmp_path / 'tank.yaml'
    assert change[0] in GOOD
    file.write_text(GOOD.replace(*change, 1))
    for command in (['check', file], ['modes', file]):
        refused(command, f'{file}: ', says)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / 'tank.yaml'
    file.write_text(GOOD)
    return file


def refused(command: list[object], *says: str) -> None:
    # rosbags leaves a damaged bag open, which a process of its own cleans up
    code, out, err = (apart if command[0] == 'replay' else within)(command)
    assert code == 1, err
    assert out == ''
    assert err.startswith('error: ')
    assert err.count('\n') == 1, err
    for text in says:
        assert text in err


def apart(command: list[object]) -> tuple[int, str, str]:
    result = slosh(*command)
    return result.returncode, result.stdout, result.stderr


def within(command: list[object]) -> tuple[int, str, str]:
    """Run slosh in this process: so many refusals would pay a second each for the same imports."""
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch('sys.argv', ['slosh', *map(str, command)]),
        redirect_stdout(out),
        redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        main()
    return end.value.code, out.getvalue(), err.getvalue()


def test_a_refusal_ends_the_command_with_one_line_and_code_1(tmp_path):
    result = slosh('check', tmp_path / 'no.yaml')
    assert (result.returncode, result.stdout) == (1, '')
    assert result.stderr.startswith('error: ')
    assert result.stderr.count('\n') == 1


def test_missing_files(tmp_path, config):
    missing = tmp_path / 'no.yaml'
    refused(['check', missing], f'{missing}: cannot be read: No such file or directory')
    refused(['check', tmp_path], 'cannot be read: Is a directory')
    refused(['replay', tmp_path / 'no_bag', '--config', config], 'no_bag: there is no such bag')
    (tmp_path / 'empty').mkdir()
    refused(['replay', tmp_path / 'empty', '--config', config], 'cannot be read as a bag')


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'ros1'])
def test_truncated_bag(tmp_path, config, kind):
    bag = write_bag(
        tmp_path / ('drive.bag' if kind == 'ros1' else 'drive'), stamps(5.0, 0.01), brake, kind
    )
    file = bag if kind == 'ros1' else next(p for p in bag.iterdir() if p.suffix != '.yaml')
    whole = file.read_bytes()
    file.write_bytes(whole[: int(0.6 * len(whole))])
    out = tmp_path / 'loads.csv'
    refused(['replay', bag, '--config', config, '--out', out], str(bag))
    assert not out.exists()


def test_bag_damaged_in_the_middle(tmp_path, config):
    """Rosbags reads on without an error; the missing messages give it away."""
    bag = write_bag(tmp_path / 'drive', stamps(20.0, 0.01), brake)
    (file,) = bag.glob('*.mcap')
    damaged = bytearray(file.read_bytes())
    middle = len(damaged) // 2
    damaged[middle : middle + 4096] = b'\xa5' * 4096
    file.write_bytes(damaged)
    out = tmp_path / 'loads.csv'
    refused(['replay', bag, '--config', config, '--out', out], str(bag), 'damaged')
    assert not list(tmp_path.glob('loads*'))


def test_bag_without_the_topic(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake, topic='/chassis/imu')
    refused(
        ['replay', bag, '--config', config, '--imu', '/imu/data'],
        'has no topic /imu/data', 'sensor_msgs/Imu is on /chassis/imu',
    )  # fmt: skip
    refused(
        ['replay', bag, '--config', config, '--twist', '/chassis/imu'],
        'has sensor_msgs/msg/Imu on /chassis/imu',
    )
    assert slosh('replay', bag, '--config', config).returncode == 0  # the only Imu there is


def test_bag_without_a_usable_sample(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), lambda t: (float('nan'), 0.0, 9.81))
    refused(
        ['replay', bag, '--config', config],
        'no sample that could be used',
        '101 rejected: not finite',
    )


def test_unknown_ending_of_the_output(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    refused(['replay', bag, '--config', config, '--out', tmp_path / 'loads.xls'], '.csv or .mcap')
    refused(
        ['replay', bag, '--config', config, '--out', tmp_path / 'no/loads.csv'],
        'cannot be written',
    )
    refused(
        ['replay', bag, '--config', config, '--imu', '/a', '--twist', '/b'], 'choose one input'
    )


@pytest.mark.parametrize(
    'command', [['modes'], ['replay', 'bag'], ['modes', 'a', '--fil', '0.5'], ['sloshh']]
)
def test_wrong_usage_exits_with_2(command):
    result = slosh(*command)
    assert result.returncode == 2
    assert 'Traceback' not in result.stderr


def test_unknown_tank_and_fill(config):
    refused(['modes', config, '--fill', '0.1:0.9'], '--fill is 0.1:0.9; a sweep is A:B:N, N fills')
    refused(['modes', config, '--tank', 'front'], 'has no tank front; it has tank')
    refused(
        ['modes', config, '--fill', '1.2'], '--fill is 1.2; it must be a ratio from 0.01 to 0.99'
    )


@pytest.mark.parametrize('option', ['--out', '--plot'])
def test_a_recording_is_never_written_over(tmp_path, config, option):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    (file,) = bag.glob('*.mcap')
    before = file.read_bytes()
    refused(['replay', bag, '--config', config, option, file], 'lies in the bag')
    refused(['replay', bag, '--config', config, option, bag / 'x.csv'], 'lies in the bag')
    refused(['replay', file, '--config', config, option, file], 'lies in the bag')
    assert file.read_bytes() == before


def test_times_that_leave_nothing(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    refused(['replay', bag, '--config', config, '--start', '5'], 'lasts 1.00 s; a start of 5 s')
    for option in ('--start', '--duration'):
        refused(['replay', bag, '--config', config, option, 'inf'], 'must be finite')


def test_output_that_cannot_be_written(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    for name in ('loads.csv', 'loads.mcap'):
        (tmp_path / name).mkdir()
        refused(['replay', bag, '--config', config, '--out', tmp_path / name], 'is a folder')
    left = sorted(p.name for p in tmp_path.iterdir())
    assert left == ['drive', 'loads.csv', 'loads.mcap', 'tank.yaml']


def test_check_tells_of_every_bad_file(tmp_path, config):
    bad = tmp_path / 'bad.yaml'
    bad.write_text(GOOD.replace('8.0', '-8.0'))
    vehicle = tmp_path / 'vehicle.yaml'
    vehicle.write_text(GOOD + 'vehicle_node:\n  ros__parameters:\n    sped: 3.0\n')
    result = slosh('check', bad, config, vehicle)
    assert result.returncode == 1
    assert f'{config}: good' in result.stdout
    assert 'bad.yaml: tank.length is -8' in result.stderr
    assert 'vehicle.yaml: ' in result.stderr


@pytest.mark.parametrize(
    'force', [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -9.81), (9.81, 0, 0)]
)
def test_an_imu_without_gravity_is_told(tmp_path, config, force):
    """Gravity removed, in units of g, upside down, on its side."""
    bag = write_bag(tmp_path / 'drive', stamps(3.0, 0.01), lambda _: force)
    result = slosh('replay', bag, '--config', config)
    assert result.returncode == 0
    assert 'the IMU must include gravity' in ' '.join(result.stdout.split())


def test_hard_braking_is_not_taken_for_a_wrong_mount(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(5.0, 0.01), lambda _: (-3.5, 0.0, 9.81))
    assert 'gravity' not in slosh('replay', bag, '--config', config).stdout
