"""Pure numerics over numpy arrays, compiled by numba; no Drake types, no state.

Whoever imports a kernel has the folder of compiled kernels made ready before numba looks for it.
"""

from drake_navbench.processes.kernel_cache import prepare_kernels

prepare_kernels()
