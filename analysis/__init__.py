"""Everything a reader sees, computed from trial logs alone."""

from drake_navbench.processes.cache_folder import provide_cache_folder

# matplotlib looks for its folder when it is imported.
provide_cache_folder()
