"""Nav2's parameter files: the nodes of a file, its release, and what each server is told."""
