"""The layers of a costmap in their order, with their results checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.layer_plugin import Layer, Observed, Seen
from drake_navbench.kernels.grid import Grid

Box = NDArray[np.float64]
Costs = NDArray[np.uint8]


class LayerStack:
    """The layers of one costmap by name, in the order in which they write; it never changes."""

    def __init__(self, layers: Mapping[str, Layer]) -> None:
        self._layers = dict(layers)

    def __len__(self) -> int:
        return len(self._layers)

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

    def are_current(self, states: Mapping[str, Any]) -> bool:
        """Returns whether all layers report that their data are up to date."""
        return all(
            layer.is_current(states[name])
            for name, layer in self._layers.items()
            if hasattr(layer, "is_current")
        )

    def written(self, states: Mapping[str, Any], grid: Grid, seen: Seen) -> Costs:
        """Returns the costs (rows, columns) after all layers wrote within the window of `seen`.

        grid: the costs before; changed in place.
        """
        costs: Costs = grid.costs
        for name, layer in self._layers.items():
            if getattr(layer, "stays_in_window", False):
                costs = layer.write(states[name], grid._replace(costs=costs), seen)
                continue
            own = layer.write(states[name], grid._replace(costs=costs.copy()), seen)
            _require_costs(name, own, costs.shape)
            costs[seen.slices] = own[seen.slices]
        return costs


def _require_costs(name: str, written: Any, shape: tuple[int, ...]) -> None:
    is_array = isinstance(written, np.ndarray) and written.dtype == np.uint8
    if not is_array or written.shape != shape:
        got = f"{written.dtype} {written.shape}" if hasattr(written, "shape") else written
        raise ValueError(f"costmap layer {name}: got {got}, expected costs uint8 {shape}")


def _box(name: str, touched: Any) -> Box:
    box = np.array(touched, dtype=np.float64)
    if box.shape != (4,) or not np.all(np.isfinite(box)):
        raise ValueError(f"costmap layer {name}: touched {box}, expected four finite numbers")
    return box
