"""The built-in controllers. Each folder holds parameters, controller, kernels or critics, presets."""
