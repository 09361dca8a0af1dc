"""
Start slosh_node on the motion of a vehicle, and rollover_node beside it.

ros2 launch slosh_ros rollover.launch.py params_file:=my_tanks.yaml vehicle_file:=my_truck.yaml

The other arguments are those of slosh.launch.py. Both nodes read params_file, so its parameters
stand below '/**:'.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    share = FindPackageShare('slosh_ros')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'vehicle_file',
                default_value=PathJoinSubstitution([share, 'config', 'rollover.yaml']),
                description='the vehicle with empty tanks',
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(
                    PathJoinSubstitution([share, 'launch', 'slosh.launch.py'])
                ),
            ),
            Node(
                package='slosh_ros',
                executable='rollover_node',
                namespace=LaunchConfiguration('namespace'),
                parameters=[
                    ParameterFile(LaunchConfiguration('params_file')),
                    ParameterFile(LaunchConfiguration('vehicle_file')),
                    {
                        'use_sim_time': ParameterValue(
                            LaunchConfiguration('use_sim_time'), value_type=bool
                        )
                    },
                ],
                remappings=[('imu/data', LaunchConfiguration('imu_topic'))],
                output='screen',
            ),
        ]
    )
