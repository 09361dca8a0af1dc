"""
Play a bag into slosh_node.

ros2 launch slosh_ros replay.launch.py bag:=highway_drive params_file:=highway_drive.yaml

The other arguments are those of slosh.launch.py; the topics are the bag's. All ends with the bag.
Without ROS, at once and the same to the last bit: `slosh replay`.
"""

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    Shutdown,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    own_defaults = {
        # the bag's topics and clock, wherever the namespace puts the node
        'imu_topic': '/imu/data',
        'twist_topic': '/twist',
        'use_sim_time': 'true',
    }
    return LaunchDescription(
        [
            DeclareLaunchArgument('bag', description='file or folder of the ROS 2 bag'),
            *(
                DeclareLaunchArgument(name, default_value=value, description='see slosh.launch.py')
                for name, value in own_defaults.items()
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(
                    PathJoinSubstitution(
                        [FindPackageShare('slosh_ros'), 'launch', 'slosh.launch.py']
                    )
                ),
                launch_arguments={
                    name: LaunchConfiguration(name) for name in own_defaults
                }.items(),
            ),
            ExecuteProcess(
                # the delay lets the node find its coefficients and its publishers
                cmd=['ros2', 'bag', 'play', LaunchConfiguration('bag'), '--clock', '--delay', '5'],
                output='screen',
                on_exit=Shutdown(reason='the bag has ended'),
            ),
        ]
    )
