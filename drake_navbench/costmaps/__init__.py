"""What costmaps are made of: settings, layers in order, maps and filter masks."""
