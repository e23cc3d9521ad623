"""Compiles the controllers of a checkout of Nav2 without ROS; see docs/native_controllers.md."""
