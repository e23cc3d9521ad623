"""The studio: pages on which scenarios are drawn, parameters changed, trials driven and looked at."""
