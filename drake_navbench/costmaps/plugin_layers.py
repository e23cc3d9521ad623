"""The layers of a costmap that are not built in, with what they return checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.layer_plugin import (
    COSTMAP_LAYERS,
    Layer,
    LayerParameters,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.kernels.grid import Grid

Box = NDArray[np.float64]


class PluginLayers:
    """The layers that are not built in, by the names of their blocks; it never changes.

    Raises InputError where one cannot be made.
    """

    def __init__(self, blocks: Mapping[str, LayerParameters], setup: LayerSetup) -> None:
        self._layers: dict[str, Layer] = {
            name: COSTMAP_LAYERS.make(block.plugin, block, setup) for name, block in blocks.items()
        }

    def __contains__(self, name: str) -> bool:
        return name in self._layers

    def initial_states(self) -> dict[str, Any]:
        """Returns the states before the first cycle, by name."""
        return {name: layer.initial_state() for name, layer in self._layers.items()}

    def observed(self, states: Mapping[str, Any], seen: Seen) -> tuple[dict[str, Any], list[Box]]:
        """Returns the new states by name, and the boxes min_x, min_y, max_x, max_y m touched."""
        after: dict[str, Any] = {}
        boxes = []
        for name, layer in self._layers.items():
            observed = layer.observe(states[name], seen)
            if not isinstance(observed, Observed):
                raise TypeError(f"costmap layer {name}: got {observed!r}, expected an Observed")
            after[name] = observed.state
            if observed.touched is not None:
                boxes.append(_box(name, observed.touched))
        return after, boxes

    def written(self, name: str, state: Any, grid: Grid, seen: Seen) -> NDArray[np.uint8]:
        """Returns the costs (rows, columns) with those of a layer; grid: a copy to write to."""
        shape = grid.costs.shape
        written = self._layers[name].write(state, grid, seen)
        is_array = isinstance(written, np.ndarray) and written.dtype == np.uint8
        if not is_array or written.shape != shape:
            got = f"{written.dtype} {written.shape}" if hasattr(written, "shape") else written
            raise ValueError(f"costmap layer {name}: got {got}, expected costs uint8 {shape}")
        return written


def _box(name: str, touched: Any) -> Box:
    box = np.array(touched, dtype=np.float64)
    if box.shape != (4,) or not np.all(np.isfinite(box)):
        raise ValueError(f"costmap layer {name}: touched {box}, expected four finite numbers")
    return box
