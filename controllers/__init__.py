"""The built-in controllers: in each folder parameters, controller, kernels or critics, presets."""

# Before numba looks for the compiled kernels of a controller.
import drake_navbench.kernels  # noqa: F401
