"""A controller for drake_navbench."""
