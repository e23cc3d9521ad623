"""The user's input: typed files of scenarios, robots, worlds and presets; checks of a task."""
