"""Pure numerics over numpy arrays, compiled by numba; no Drake types, no state.

Importing this package prepares the folder of compiled kernels before numba looks for it.
"""

from drake_navbench.processes.kernel_cache import prepare_kernels

prepare_kernels()
