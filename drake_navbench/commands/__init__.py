"""The commands of `python -m drake_navbench COMMAND`, one file each."""
