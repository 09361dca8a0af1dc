"""
What a step costs, against the fuel slosh of Basilisk (`bsk`): masses on springs in a spacecraft.

What each does in a step is not the same. Basilisk's spacecraft is free: its six degrees of freedom
and the masses are one system, which a fourth-order Runge-Kutta method moves on, so that the
effectors are evaluated four times, in C++. The engine is told the vehicle's motion, moves the same
number of modes on exactly and gives the wrenches at every sample, in NumPy. The empty spacecraft's
share is taken off, and the time that Basilisk's own scheduler needs with it. Both go by the step
that simulators of vehicles use, 10 ms, and keep no record.

Basilisk runs all steps by one call. Three figures are given for us: the whole engine, which also
judges each sample, carries it to the tank and watches over linear theory, fed sample by sample as
in a node; the same fed with blocks of samples as by `slosh replay`; and the modes alone in blocks,
from forcing to wrench, which is what an effector does.
"""

from __future__ import annotations

import math
import sys
import time

import numpy as np
from engine import cost_of, drive, engine_of
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from slosh_ros.engine import MotionSample
from slosh_ros.modal import ModalIntegrator
from slosh_ros.modal.loads import LoadMatrices

Array = NDArray[np.float64]

MASSES = (2, 8)
STEP = 0.01  # [s]
STEPS, REPEATS = 512, 20
BLOCK = 256  # samples
TARGET = 10.0


def spacecraft_of(masses: int, steps: int) -> float:
    """Time of a step of Basilisk's spacecraft with so many sloshing masses [us]."""
    from Basilisk.simulation import linearSpringMassDamper, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess('process')
    process.addTask(simulation.CreateNewTask('task', macros.sec2nano(STEP)))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub = 750.0  # [kg]
    craft.hub.IHubPntBc_B = [[900.0, 0.0, 0.0], [0.0, 800.0, 0.0], [0.0, 0.0, 600.0]]  # [kg m^2]
    craft.hub.r_BcB_B = [[0.0], [0.0], [0.0]]  # [m]
    kept = []
    for k in range(masses):
        mass = linearSpringMassDamper.LinearSpringMassDamper()
        mass.massInit, mass.k, mass.c = 10.0, 10.0 * (k + 1), 0.1  # [kg], [N/m], [N s/m]
        mass.r_PB_B = [[0.1], [0.0], [-0.1 * k]]  # [m]
        mass.pHat_B = [[1.0 - k % 2], [float(k % 2)], [0.0]]  # by turns along x and y
        mass.rhoInit, mass.rhoDotInit = 0.05, 0.0  # [m], [m/s]
        craft.addStateEffector(mass)
        kept.append(mass)
    simulation.AddModelToTask('task', craft)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(STEP * steps))
    began = time.process_time()
    simulation.ExecuteSimulation()
    return 1e6 * (time.process_time() - began) / steps


def in_blocks(masses: int, stamps: list[int], values: Array) -> float:
    """Time of a sample of the whole engine, many at once as `slosh replay` feeds them [us]."""
    engine = engine_of(1, masses)
    engine.feed(MotionSample.of(stamps[0], tuple(values[0])))
    began = time.process_time()
    for k in range(1, len(stamps), BLOCK):
        assert engine.feed_all(stamps[k : k + BLOCK], values[k : k + BLOCK]) is not None
    return 1e6 * (time.process_time() - began) / (len(stamps) - 1)


def modes_alone(masses: int, steps: int) -> float:
    """Time of a step of the modes, from their forcing to the wrench, many at once [us]."""
    tank = engine_of(1, masses).tanks[0]
    loads = LoadMatrices.of(tank.coefficients, tank.damping_ratio)
    modes = ModalIntegrator(tank.coefficients.omega, tank.damping_ratio)
    forcing = 0.1 * np.sin(np.arange(steps * masses)).reshape(steps, masses)
    still = np.zeros_like(forcing)
    began = time.process_time()
    for k in range(0, steps, BLOCK):
        force, carried = forcing[k : k + BLOCK], still[k : k + BLOCK]
        wave = modes.advance_through([STEP] * len(force), force, carried, force.astype(complex))
        beta = wave.imag / modes.damped
        loads.state(beta.T, (wave.real - tank.damping_ratio * tank.coefficients.omega * beta).T)
    return 1e6 * (time.process_time() - began) / steps


def main(steps: int = STEPS, repeats: int = REPEATS) -> dict[str, object]:
    """Measure by turns, print a table and return the numbers; nothing without Basilisk."""
    try:
        import Basilisk  # noqa: F401
    except ImportError:
        print('Basilisk is not installed; pip install bsk', file=sys.stderr)
        return {}
    motion = drive(steps)
    theirs = dict.fromkeys((0, *MASSES), math.inf)
    ours, blocks, alone = (dict.fromkeys(MASSES, math.inf) for _ in range(3))
    stamps = [sample.stamp for sample in motion]
    values = np.array([sample.values for sample in motion])
    for _ in range(repeats):
        for masses in theirs:
            theirs[masses] = min(theirs[masses], spacecraft_of(masses, steps))
        for masses in ours:
            ours[masses] = min(ours[masses], cost_of(engine_of(1, masses), motion, 1))
            blocks[masses] = min(blocks[masses], in_blocks(masses, stamps, values))
            alone[masses] = min(alone[masses], modes_alone(masses, steps))
    table = Table(
        'masses',
        'Basilisk [us]',
        'its slosh',
        'engine',
        'ratio',
        'in blocks',
        'ratio',
        'modes',
        'ratio',
    )
    table.add_row('0', f'{theirs[0]:.1f}')
    results: dict[str, object] = {'target': TARGET, 'empty_spacecraft_us': theirs[0]}
    for masses in MASSES:
        slosh = theirs[masses] - theirs[0]
        figures = {
            'basilisk_us': theirs[masses], 'slosh_us': slosh,
            'engine_us': ours[masses], 'engine_ratio': slosh / ours[masses],
            'blocks_us': blocks[masses], 'blocks_ratio': slosh / blocks[masses],
            'modes_us': alone[masses], 'modes_ratio': slosh / alone[masses],
        }  # fmt: skip
        table.add_row(f'{masses}', *(f'{value:.1f}' for value in figures.values()))
        results[str(masses)] = figures
    Console(width=100).print(table)
    return results


if __name__ == '__main__':
    main()
