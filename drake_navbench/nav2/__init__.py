"""Nav2's parameter files: the nodes of a file, its release, and the parameters of each server."""
