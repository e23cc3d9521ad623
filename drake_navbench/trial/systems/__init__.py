"""The LeafSystems of a trial, one a file."""
