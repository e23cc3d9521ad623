"""A leaderboard: a suite whose seeds can be sealed, entries that are checked, ranks with ties."""
