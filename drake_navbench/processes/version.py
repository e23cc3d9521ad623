"""The version of the code that runs, as logs and manifests name it."""

__version__ = "0.1.0"
