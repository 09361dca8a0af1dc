"""
Let a simulated tractor-semitrailer and slosh_node act on each other.

ros2 launch slosh_ros closed_loop.launch.py scenario:=brake_bump

A scenario is a parameter file for both nodes in config/scenarios, named without its ending;
another file is given as params_file. The other arguments are those of slosh.launch.py. All ends
with the manoeuvre.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    share = FindPackageShare('slosh_ros')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'scenario',
                default_value='brake_bump',
                description='name of a file in config/scenarios, without its ending',
            ),
            DeclareLaunchArgument(
                'params_file',
                # PathJoinSubstitution takes no name to be put together before launch 3.4.5
                default_value=[
                    share,
                    '/config/scenarios/',
                    LaunchConfiguration('scenario'),
                    '.yaml',
                ],
                description='parameters of vehicle_node and slosh_node',
            ),
            DeclareLaunchArgument(
                'use_sim_time',
                default_value='true',  # vehicle_node is the clock, and runs faster than real time
                description='take the time from /clock',
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(
                    PathJoinSubstitution([share, 'launch', 'slosh.launch.py'])
                ),
                launch_arguments={
                    'params_file': LaunchConfiguration('params_file'),
                    'use_sim_time': LaunchConfiguration('use_sim_time'),
                }.items(),
            ),
            Node(
                package='slosh_ros',
                executable='vehicle_node',
                namespace=LaunchConfiguration('namespace'),
                parameters=[ParameterFile(LaunchConfiguration('params_file'))],
                output='screen',
                on_exit=Shutdown(reason='the scenario has ended'),
            ),
        ]
    )
