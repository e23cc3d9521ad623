"""The built-in controllers: in each folder parameters, controller, kernels or critics, presets."""
