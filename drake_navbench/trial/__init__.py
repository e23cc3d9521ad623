"""One trial: the diagram built, planned, simulated and logged."""
