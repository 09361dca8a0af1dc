#!/usr/bin/env python3
"""
Work out how the two IMUs sit in their vehicles: the evidence behind `imu.rpy` in README.md.

A levelled IMU feels a_x = dv/dt + g sin(grade) and a_y = v r. The intercepts of these two
regressions are what gravity puts on the tilted axes, free of the drive's mean acceleration.

    python bags/mounting.py
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from make_bags import (
    FRD_TO_FLU,
    HERE,
    IMU_TOPIC,
    NS_PER_S,
    SOURCE,
    TYPES,
    Floats,
    SourceError,
    read_array,
    read_highway,
)
from rosbags.highlevel import AnyReader
from rosbags.typesys.stores import ros2_jazzy as ros2
from scipy.signal import butter, filtfilt
from scipy.spatial.transform import Rotation

LOW_PASS = 0.5  # [Hz] the vehicle's manoeuvres pass, vibration and bumps do not
EDGE = 3.0  # [s] left out at both ends, where the zero-phase filter has no past or future
LAGS = np.arange(-60, 61) * 0.01  # [s] searched for a delay between two sensors
GRAVITY = 9.80  # [m/s2] at both places (37.7 N: 9.7997, 42.4 N: 9.804)
WGS84_E2 = 6.694_379_990_14e-3  # first eccentricity squared

# Husky: sensor x points right, y up, z backward. Columns: sensor axes in base_link.
HUSKY_AXES = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
HUSKY_STANDSTILL = 1e-3  # [m/s, rad/s] odometry below this is standstill
STANDSTILL_EDGE = 0.5  # [s] left out at both ends of a standstill: braking, starting, odometry lag


@dataclass(frozen=True)
class Line:
    """Least-squares line y = intercept + slope x, rms of the residual, correlation of x and y."""

    intercept: float
    slope: float
    rms: float
    r: float


@dataclass(frozen=True)
class HighwayMounting:
    """What the comma2k19 minute tells about its IMU."""

    rpy: Floats  # [rad]
    a_x: Line  # against dv/dt + g sin(grade)
    a_x_no_grade: Line  # against dv/dt alone: takes the mean grade for a tilt
    a_y: Line  # against v r
    level_force: Floats  # [m/s2] of the vehicle at rest on level ground, in base_link
    gyro_bias: Floats  # [rad/s] FLU, against the reference pose
    mean_grade: float  # [rad]
    squat: Line  # device pitch, nose down, against dv/dt + g sin(grade) [rad/(m/s2)]
    speed_lag: float  # [s] of the CAN speed behind the accelerometer


@dataclass(frozen=True)
class HuskyMounting:
    """What the Husky bag tells about its IMU."""

    rpy: Floats  # [rad]
    a_x: Line  # against dv/dt
    a_y: Line  # against v r
    yaw_rate: Line  # gyro against odometry, lag taken out
    odom_lag: float  # [s] of the odometry behind the IMU
    rest: tuple[float, float]  # [s] since the first Imu stamp
    rest_force: Floats  # [m/s2] levelled, in base_link: what is left is the slope of the ground
    rest_rpy: Floats  # [rad] that would level the standstill, slope of the ground included
    gyro_bias: Floats  # [rad/s] base_link axes, at rest


def low_pass(times: Floats, values: Floats) -> Floats:
    """Filter without phase shift, second order."""
    b, a = butter(2, LOW_PASS, fs=1.0 / float(np.median(np.diff(times))))
    return np.asarray(filtfilt(b, a, values, axis=0))


def inner(times: Floats) -> slice:
    """Select the samples away from the ends."""
    first, last = np.searchsorted(times, [times[0] + EDGE, times[-1] - EDGE])
    return slice(int(first), int(last))


def fit_line(x: Floats, y: Floats) -> Line:
    """Fit y = intercept + slope x."""
    slope, intercept = np.polyfit(x, y, 1)
    rms = float(np.std(y - intercept - slope * x))
    return Line(float(intercept), float(slope), rms, float(np.corrcoef(x, y)[0, 1]))


def lag_behind(times: Floats, reference: Floats, follower: Floats) -> float:
    """Delay of `follower` behind `reference` at the best correlation."""
    use = inner(times)
    scores = [
        np.corrcoef(np.interp(times + lag, times, follower)[use], reference[use])[0, 1]
        for lag in LAGS
    ]
    return float(LAGS[int(np.argmax(scores))])


def levelling(force: Floats) -> Rotation:
    """Smallest roll, then pitch, that turn the specific force at rest onto z."""
    x, y, z = force
    return Rotation.from_euler('xyz', [np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z)), 0.0])


def highway(source: Path = SOURCE) -> HighwayMounting:
    """
    Work out the mounting of the comma2k19 device.

    The reference pose of the data set gives the grade of the road (direction of its velocity) and
    the bias of the gyro. It was made from GNSS, camera and this IMU, so it is no independent
    witness of the gyro; its climb agrees with the altitude of the GNSS receiver alone.
    """
    drive = read_highway(source)
    pose = source / 'comma2k19' / 'global_pose'
    pose_t = read_array(pose / 'frame_times')
    position = read_array(pose / 'frame_positions')  # ECEF
    velocity = read_array(pose / 'frame_velocities')  # ECEF
    w_xyz = read_array(pose / 'frame_orientations')  # quaternion, w first: device FRD to ECEF
    device = Rotation.from_quat(w_xyz[:, [1, 2, 3, 0]])  # SciPy wants w last

    longitude = np.arctan2(position[:, 1], position[:, 0])
    latitude = np.arctan2(
        position[:, 2], (1.0 - WGS84_E2) * np.hypot(position[:, 0], position[:, 1])
    )
    up = np.column_stack(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ]
    )
    grade = np.arcsin(np.sum(up * velocity, axis=1) / np.linalg.norm(velocity, axis=1))

    turned = (device[:-1].inv() * device[1:]).as_rotvec().sum(axis=0) * FRD_TO_FLU
    gyro_bias = drive.angular_rate.mean(axis=0) - turned / (pose_t[-1] - pose_t[0])

    t = drive.imu_t
    use = inner(t)
    force = low_pass(t, drive.specific_force)
    speed = low_pass(t, np.interp(t, drive.speed_t, drive.speed))
    acceleration = np.gradient(speed, t)
    climb = GRAVITY * np.sin(low_pass(t, np.interp(t, pose_t, grade)))
    yaw_rate = low_pass(t, drive.angular_rate[:, 2]) - gyro_bias[2]

    along = (acceleration + climb)[use]  # what a levelled IMU feels forward
    a_x = fit_line(along, force[use, 0])
    a_y = fit_line((speed * yaw_rate)[use], force[use, 1])
    a_z = fit_line(along, force[use, 2])
    tilted = np.array([a_x.intercept, a_y.intercept, a_z.intercept])
    level = levelling(tilted)

    # Device against path: minus the angle of the velocity above the device's forward axis.
    seen = device.inv().apply(velocity)
    nose_down = low_pass(pose_t, np.arctan2(-seen[:, 2], seen[:, 0]))
    inside = inner(pose_t)
    squat = fit_line(np.interp(pose_t, t, acceleration + climb)[inside], nose_down[inside])
    return HighwayMounting(
        rpy=level.as_euler('xyz'),
        a_x=a_x,
        a_x_no_grade=fit_line(acceleration[use], force[use, 0]),
        a_y=a_y,
        level_force=level.apply(tilted),
        gyro_bias=gyro_bias,
        mean_grade=float(grade.mean()),
        squat=squat,
        speed_lag=lag_behind(t, force[:, 0] - climb, acceleration),
    )


def husky(bag: Path = HERE / 'husky') -> HuskyMounting:
    """
    Work out the mounting of the Husky's IMU.

    The ground is not level and the only standstill is at one place, so the tilt comes from the
    whole drive: the intercepts average the slope of the ground over the path.
    """
    imu: list[tuple[int, list[float]]] = []
    odom: list[tuple[int, list[float]]] = []
    with AnyReader([bag], default_typestore=TYPES) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == IMU_TOPIC:
                sample = cast('ros2.sensor_msgs__msg__Imu', message)
                stamp = sample.header.stamp
                a, w = sample.linear_acceleration, sample.angular_velocity
                row = [a.x, a.y, a.z, w.x, w.y, w.z]
                imu.append((stamp.sec * NS_PER_S + stamp.nanosec, row))
            else:
                twist = cast('ros2.geometry_msgs__msg__TwistStamped', message)
                stamp = twist.header.stamp
                row = [twist.twist.linear.x, twist.twist.angular.z]
                odom.append((stamp.sec * NS_PER_S + stamp.nanosec, row))
    start = imu[0][0]
    t = np.array([(stamp - start) / NS_PER_S for stamp, _ in imu])
    odom_t = np.array([(stamp - start) / NS_PER_S for stamp, _ in odom])
    sensor = np.array([row for _, row in imu]).reshape(-1, 2, 3)
    force, rate = np.moveaxis(sensor @ HUSKY_AXES.T, 1, 0)
    speed, odom_rate = np.array([row for _, row in odom]).T

    slow_force, slow_rate = low_pass(t, force), low_pass(t, rate)
    lag = lag_behind(t, slow_rate[:, 2], low_pass(t, np.interp(t, odom_t, odom_rate)))
    v = low_pass(t, np.interp(t + lag, odom_t, speed))
    use = inner(t)
    along = np.gradient(v, t)[use]
    a_x = fit_line(along, slow_force[use, 0])
    a_y = fit_line((v * slow_rate[:, 2])[use], slow_force[use, 1])
    a_z = fit_line(along, slow_force[use, 2])
    tilted = np.array([a_x.intercept, a_y.intercept, a_z.intercept])
    level = levelling(tilted)

    still = (np.abs(speed) < HUSKY_STANDSTILL) & (np.abs(odom_rate) < HUSKY_STANDSTILL)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], still, [False])).astype(int)))
    spans = [(odom_t[a], odom_t[b - 1]) for a, b in edges.reshape(-1, 2)]
    longest = max(spans, key=lambda span: float(span[1] - span[0]))
    rest = (float(longest[0]) + STANDSTILL_EDGE, float(longest[1]) - STANDSTILL_EDGE)
    resting = (t >= rest[0]) & (t <= rest[1])

    axes = Rotation.from_matrix(HUSKY_AXES)
    odom_now = low_pass(t, np.interp(t + lag, odom_t, odom_rate))
    return HuskyMounting(
        rpy=(level * axes).as_euler('xyz'),
        a_x=a_x,
        a_y=a_y,
        yaw_rate=fit_line(odom_now[use], slow_rate[use, 2]),
        odom_lag=lag,
        rest=rest,
        rest_force=level.apply(force[resting].mean(axis=0)),
        rest_rpy=(levelling(force[resting].mean(axis=0)) * axes).as_euler('xyz'),
        gyro_bias=rate[resting].mean(axis=0),
    )


def show(name: str, result: HighwayMounting | HuskyMounting) -> None:
    """Print one result, a field a line."""
    print(name)
    for key, value in vars(result).items():
        if isinstance(value, Line):
            text = (
                f'intercept {value.intercept:+.4f}, slope {value.slope:+.4f}, '
                f'rms {value.rms:.4f}, r {value.r:+.3f}'
            )
        else:
            text = ' '.join(f'{number:+.4f}' for number in np.atleast_1d(value))
        print(f'  {key:13} {text}')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the script and return its exit code."""
    parser = argparse.ArgumentParser(
        description='Work out how the two IMUs sit in their vehicles.'
    )
    parser.add_argument(
        '--source', type=Path, default=SOURCE, help='folder of the originals (%(default)s)'
    )
    args = parser.parse_args(argv)
    try:
        show('highway_drive', highway(args.source))
    except SourceError as error:
        print(f'mounting: {error}', file=sys.stderr)
        return 1
    show('husky', husky())
    return 0


if __name__ == '__main__':
    sys.exit(main())
