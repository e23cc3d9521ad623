"""Loads everything a trial needs when imported.

multiprocessing's fork server imports this module once and forks every worker from itself, so that
no worker spends time on imports or on reading compiled kernels. Nothing else should import it.
"""

import signal

from drake_navbench.warm_up import warm_up

# Ctrl-C reaches the whole process group; what it means is for the command alone to decide.
signal.signal(signal.SIGINT, signal.SIG_IGN)
warm_up()
