"""Worker processes, how they are told what to do and where they keep compiled kernels."""
