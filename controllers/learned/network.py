"""A network of two hidden layers, in numpy, and its file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from drake_navbench.controllers.learned.features import FEATURE_COUNT
from drake_navbench.errors import InputError
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.array_file import NoArray, arrays_of
from drake_navbench.typed_files.input_file import read_input

ACTION_COUNT = 2
MAX_FILE_BYTES = 2**24


@dataclass(frozen=True, eq=False)
class Network:
    """y = W3 tanh(W2 tanh(W1 x + b1) + b2) + b3; weights are (inputs, outputs)."""

    weight_1: Array
    bias_1: Array
    weight_2: Array
    bias_2: Array
    weight_3: Array
    bias_3: Array

    def __call__(self, inputs: Array) -> Array:
        """Returns (..., outputs) for (..., inputs)."""
        first = np.tanh(inputs @ self.weight_1 + self.bias_1)
        second = np.tanh(first @ self.weight_2 + self.bias_2)
        return second @ self.weight_3 + self.bias_3


def save_network(network: Network, path: Path) -> None:
    """Writes the weights in single precision; equal networks give equal bytes."""
    arrays = {f.name: getattr(network, f.name).astype(np.float32) for f in fields(Network)}
    np.savez(path, **arrays)


def load_network(path: Path) -> Network:
    """Returns the network of a file; raises InputError where it holds none."""
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    expected = [field.name for field in fields(Network)]
    try:
        found = arrays_of(content, expected, max_bytes=MAX_FILE_BYTES)
    except NoArray as error:
        raise InputError(
            f"{path}: {error}; expected a file of numpy.savez with {', '.join(expected)}"
        ) from error
    if any(np.iscomplexobj(array) for array in found.values()):
        raise InputError(f"{path}: expected real numbers")
    arrays = {name: array.astype(np.float64) for name, array in found.items()}
    network = Network(**arrays)
    _require_shapes(network, path)
    return network


def _require_shapes(network: Network, path: Path) -> None:
    sizes = [FEATURE_COUNT, network.bias_1.size, network.bias_2.size, ACTION_COUNT]
    layers = (
        (network.weight_1, network.bias_1),
        (network.weight_2, network.bias_2),
        (network.weight_3, network.bias_3),
    )
    for number, (weight, bias) in enumerate(layers, start=1):
        wanted = (sizes[number - 1], sizes[number])
        if weight.shape != wanted or bias.shape != wanted[1:]:
            raise InputError(
                f"{path}: layer {number}: got weights {weight.shape} and bias {bias.shape}, "
                f"expected {wanted} and {wanted[1:]}"
            )
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise InputError(f"{path}: layer {number}: expected finite numbers")
