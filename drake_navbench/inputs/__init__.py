"""What is asked for: typed files of scenarios, robots, worlds and presets; checks of a task."""
