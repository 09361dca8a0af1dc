"""Scenarios: one table of parameters for both trucks, and the library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import REPOSITORY
from ruamel.yaml import YAML
from test_truck_general import COEFFICIENTS

from slosh_ros.errors import InputError
from slosh_ros.hydro import coefficients_of
from slosh_ros.parameters import read_parameter_file
from slosh_ros.tank import cylinder_x
from slosh_ros.vehicle import (
    Drive,
    GeneralParameters,
    GeneralSimulator,
    Journey,
    RigidCargo,
    TankLiquid,
    TruckSimulator,
)
from slosh_ros.vehicle.road import Profile
from slosh_ros.vehicle.scenario import PARAMETERS, Scenario

CONFIG = REPOSITORY / 'config'
LIBRARY = sorted((CONFIG / 'scenarios').glob('*.yaml'))
GENERAL = {'vehicle': 'general', 'manoeuvre': 'cruise', 'duration': 0.5}


def tank() -> TankLiquid:
    at = np.array([0.0, 0.0, 1.12746])
    return TankLiquid.of(COEFFICIENTS, np.zeros(8), at, tank=cylinder_x(1.125, 14.0))


def test_library_holds_what_is_promised() -> None:
    names = {path.stem for path in LIBRARY}
    paper = {
        f'paper_{case}_{road}'
        for case in ('brake', 'accelerate_0p1g', 'accelerate_0p2g')
        for road in ('flat', 'bump', 'pit')
    }
    wanted = {'brake', 'brake_bump', 'brake_pit', 'accelerate', 'step_steer', 'lane_change'}
    assert paper | wanted | {'roundabout', 'one_sided_bump'} <= names


@pytest.mark.parametrize(
    ('truck', 'height', 'peak'),
    [
        ('corrected', 0.2, 27.58),
        ('calibrated', -0.2, 25.10),
        ('calibrated', 0.0, 21.20),
        ('calibrated', 0.2, 26.60),
    ],
)
def test_preset_has_its_peak_force(truck: str, height: float, peak: float) -> None:
    # VEHICLE 5.2; the calibration goes with a damping of its own
    given = {'truck': truck, 'coefficients': 'table_4', 'bump.height': height, 'duration': 11.2}
    force = Scenario.from_parameters(given).simulate([]).slosh[:, 0]
    assert force.max() / 1e3 == pytest.approx(peak, rel=2e-3)


def test_printed_equations_run_away() -> None:
    given = {'truck': 'paper_as_printed', 'coefficients': 'table_4', 'bump.height': 0.2}
    assert np.abs(Scenario.from_parameters(given).simulate([]).slosh[:, 0]).max() > 1e9


def test_variants_stand_beside_what_was_asked() -> None:
    def labels(given: dict[str, object]) -> list[str]:
        variants = Scenario.from_parameters(given).variants
        assert [v.label for v in variants.values()] == list(variants)
        return list(variants)

    assert labels({}) == ['exact coefficients', 'solid cargo']
    assert labels({'coefficients': 'table_4'}) == ['Table 4', 'exact coefficients', 'solid cargo']
    assert labels(GENERAL) == ['exact inertia', 'frozen inertia', 'solid cargo']
    frozen = {**GENERAL, 'liquid_inertia': 'frozen'}
    assert labels(frozen) == ['frozen inertia', 'exact inertia', 'solid cargo']
    assert labels({'cargo': 'solid'}) == ['solid cargo', 'exact coefficients']


def test_frozen_inertia_leaves_out_the_relief_of_the_tank() -> None:
    exact, frozen = (
        Scenario.from_parameters({**GENERAL, 'liquid_inertia': kind})
        for kind in ('exact', 'frozen')
    )
    relief = tank().relief
    assert np.abs(relief).max() > 1e4
    np.testing.assert_array_equal(exact.sloshing([tank()]).relief, relief)
    np.testing.assert_array_equal(frozen.sloshing([tank()]).relief, 0.0)


def test_tank_must_hold_the_liquid_that_the_truck_carries() -> None:
    tank_03 = cylinder_x(1.125, 14.0)
    c = coefficients_of(tank_03, tank_03.depth(0.3), 1000.0, 4)
    less = TankLiquid.of(c, np.zeros(4), np.array([0.0, 0.0, 1.12746]))
    with pytest.raises(InputError, match=r'16699.5 kg .* carries 27832.5 kg .* of section 5'):
        Scenario.from_parameters({}).simulate([less])
    with pytest.raises(InputError, match=r'for these tanks write liquid.mass: 16699.5') as refusal:
        Scenario.from_parameters(GENERAL).simulate([less])
    # what the message says is what it wants
    _, _, remedy = str(refusal.value).partition('write ')
    given = YAML(typ='safe').load('{' + remedy + '}')
    Scenario.from_parameters({**GENERAL, **given}).simulate([less])
    ahead = replace(tank(), origin=np.array([0.2, 0.0, 1.12746]))
    with pytest.raises(InputError, match=r'\(0.2, 0, 0.65\) m'):
        Scenario.from_parameters(GENERAL).simulate([ahead])
    Scenario.from_parameters({'cargo': 'solid'}).simulate([less])  # it is not asked


def test_every_parameter_of_the_truck_is_commented_in_yaml() -> None:
    file = CONFIG / 'general_truck.yaml'
    given = read_parameter_file(file, 'vehicle_node')
    told = GeneralParameters.told()
    assert {name for name in given if name.startswith('chassis.')} == {
        f'chassis.{name}' for name in told
    }
    plan = Scenario.from_file(file).plan
    assert isinstance(plan, Drive)
    assert plan.truck.parameters == GeneralParameters()
    lines = {line.partition(':')[0].strip(): line for line in file.read_text().splitlines()}
    for name, parameter in told.items():
        comment = lines[name].partition('#')[2]
        assert f'[{parameter.unit}]' in comment or not parameter.unit, name
        for source in ('ASSUMED', 'Table 3'):
            assert (source in comment) == (source in parameter.source), name


def test_both_trucks_have_a_simulator() -> None:
    paper, general = Scenario.from_parameters({}), Scenario.from_parameters(GENERAL)
    assert isinstance(paper.plan, Journey)
    assert isinstance(general.plan, Drive)
    assert isinstance(paper.simulator(), TruckSimulator)
    assert isinstance(general.simulator(), GeneralSimulator)
    assert not paper.exact_inertia
    assert general.exact_inertia


@pytest.mark.parametrize('given', [{}, GENERAL], ids=['paper', 'general'])
def test_only_the_liquid_that_the_truck_carries_is_accepted(given: dict[str, object]) -> None:
    scenario, own = Scenario.from_parameters(given), RigidCargo.half_full()
    scenario.check_liquid(own)
    scenario.check_liquid(replace(own, mass=1.005 * own.mass))
    for other in (replace(own, mass=0.98 * own.mass), RigidCargo.half_full(height=0.75)):
        with pytest.raises(InputError, match=f'slosh_node holds {other.mass:.6g} kg of liquid at'):
            scenario.check_liquid(other)


def test_remedy_for_another_liquid_is_accepted() -> None:
    other = RigidCargo.principal(9000.0, (0.5, 0.0, 0.8), (5e3, 9e4, 9.1e4))
    with pytest.raises(InputError) as refusal:
        Scenario.from_parameters(GENERAL).check_liquid(other)
    _, _, remedy = str(refusal.value).partition('write ')
    given = YAML(typ='safe').load('{' + remedy + '}')
    Scenario.from_parameters({**GENERAL, **given}).check_liquid(other)


def test_solid_cargo_does_not_slosh() -> None:
    scenario = Scenario.from_parameters({**GENERAL, 'cargo': 'solid'})
    assert scenario.simulate([tank()]).beta.shape == (51, 0)


def test_every_parameter_of_the_truck_has_a_row_and_arrives() -> None:
    rows = [name for name in PARAMETERS if name.startswith('chassis.')]
    assert len(rows) == 30
    for name in rows:
        row = PARAMETERS[name]
        assert row.meaning
        changed: object
        if isinstance(row.default, bool):
            changed = not row.default
        elif isinstance(row.default, list):
            changed = [1.0 + x for x in row.default]
        else:
            assert isinstance(row.default, float)
            changed = 1.0 + row.default
        plan = Scenario.from_parameters({**GENERAL, name: changed}).plan
        assert isinstance(plan, Drive)
        found = getattr(plan.truck.parameters, name.removeprefix('chassis.'))
        assert found == (tuple(changed) if isinstance(changed, list) else changed)


def test_one_number_serves_all_axles() -> None:
    plan = Scenario.from_parameters({**GENERAL, 'chassis.track': 2.0}).plan
    assert isinstance(plan, Drive)
    assert plan.truck.parameters.track == (2.0, 2.0, 2.0, 2.0)


def test_resolved_parameters_may_be_given_again() -> None:
    # as vehicle_node does, which declares them all
    row = {name: r.default for name, r in PARAMETERS.items() if r.default is not None}
    assert isinstance(Scenario.from_parameters(row).plan, Journey)
    assert isinstance(Scenario.from_parameters({**row, 'vehicle': 'general'}).plan, Drive)


def test_measured_profile_and_random_road() -> None:
    points = {'road.position': [0.0, 1.0, 2.0], 'road.left': [0.0, 0.1, 0.0]}
    plan = Scenario.from_parameters({**GENERAL, 'road.kind': 'profile', **points}).plan
    assert isinstance(plan, Drive)
    assert plan.road.left is plan.road.right
    other = {**points, 'road.right': [0.0, 0.2, 0.0]}
    plan = Scenario.from_parameters({**GENERAL, 'road.kind': 'profile', **other}).plan
    assert isinstance(plan, Drive)
    np.testing.assert_allclose(plan.road.under(np.array([1.0]))[0], [[0.1, 0.2]])
    plan = Scenario.from_parameters({**GENERAL, 'road.kind': 'random'}).plan
    assert isinstance(plan, Drive)
    assert isinstance(plan.road.left, Profile)


def test_radius_sets_the_angle() -> None:
    given = {**GENERAL, 'steering.kind': 'step', 'steering.radius': -50.0}
    plan = Scenario.from_parameters(given).plan
    assert isinstance(plan, Drive)
    assert plan.steering.angle(9.0, 9.0) == pytest.approx(-5.2 / 50.0, rel=0.3)


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'steering.kind': 'step'}, 'vehicle: general'),
        ({'chassis.track': 2.0}, 'chassis.track says nothing to vehicle paper'),
        ({**GENERAL, 'truck': 'calibrated'}, 'write vehicle: paper'),
        ({**GENERAL, 'chassis.track': [2.0, 2.0]}, '2 numbers for 4 axles'),
        ({**GENERAL, 'chassis.trak': 2.0}, 'did you mean chassis.track'),
        ({**GENERAL, 'steering.radius': 1.0}, 'steering.radius is 1 m'),
        ({**GENERAL, 'road.kind': 'profile'}, 'road.position is missing'),
        ({**GENERAL, 'chassis.track': -1.0}, 'at least 0'),
    ],
)
def test_bad_scenario_is_refused_in_words(given: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Scenario.from_parameters(given)
