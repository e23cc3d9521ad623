"""ROS 2 without ROS: recordings as files, and a running stack over DDS."""
