"""The contract of a costmap layer by its old name, which works until version 0.2.

Its place is `drake_navbench.navigation.costmaps.layer_plugin`.
"""

from drake_navbench.navigation.costmaps.layer_plugin import Layer, LayerParameters

__all__ = ["Layer", "LayerParameters"]
