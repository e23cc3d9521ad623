"""Everything a reader sees, computed from trial logs alone."""
