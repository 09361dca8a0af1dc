"""
Start slosh_node on the motion of a vehicle.

ros2 launch slosh_ros slosh.launch.py params_file:=my_tanker.yaml imu_topic:=/imu
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'namespace', default_value='', description='of the node and its topics'
            ),
            DeclareLaunchArgument(
                'params_file',
                default_value=PathJoinSubstitution(
                    [FindPackageShare('slosh_ros'), 'config', 'half_full_tanker.yaml']
                ),
                description='the tanks, their fill and the pose of the IMU',
            ),
            DeclareLaunchArgument(
                'use_sim_time', default_value='false', description='take the time from /clock'
            ),
            DeclareLaunchArgument(
                'imu_topic', default_value='imu/data', description='sensor_msgs/Imu to listen to'
            ),
            DeclareLaunchArgument(
                'twist_topic', default_value='twist', description='or the twist to listen to'
            ),
            Node(
                package='slosh_ros',
                executable='slosh_node',
                namespace=LaunchConfiguration('namespace'),
                parameters=[
                    ParameterFile(LaunchConfiguration('params_file')),
                    {
                        'use_sim_time': ParameterValue(
                            LaunchConfiguration('use_sim_time'), value_type=bool
                        )
                    },
                ],
                remappings=[
                    ('imu/data', LaunchConfiguration('imu_topic')),
                    ('twist', LaunchConfiguration('twist_topic')),
                ],
                output='screen',
            ),
        ]
    )
