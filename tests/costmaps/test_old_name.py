"""The contract of a costmap layer is still found by the name that it had before."""

from drake_navbench.costmaps import layer_plugin as old
from drake_navbench.navigation.costmaps import layer_plugin as new


def test_a_layer_that_imports_the_old_name_has_the_contract_itself():
    assert old.Layer is new.Layer
    assert old.LayerParameters is new.LayerParameters
