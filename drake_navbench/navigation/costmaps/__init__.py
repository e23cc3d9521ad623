"""The parts of a costmap: settings, layers in order, maps and filter masks."""
