"""Studies: trials driven for a question of their own."""
