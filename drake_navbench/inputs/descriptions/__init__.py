"""Robots and worlds as ROS and Gazebo describe them: xacro, URDF, SDF, worlds, meshes."""
