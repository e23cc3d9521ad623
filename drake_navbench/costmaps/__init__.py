"""The old name of `drake_navbench.navigation.costmaps`, kept for plugins."""
