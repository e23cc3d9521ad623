"""A running ROS 2 stack in the loop, over DDS, without ROS on this side."""
