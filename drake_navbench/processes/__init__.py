"""Worker processes, the protocol to them, and their cache of compiled kernels."""
