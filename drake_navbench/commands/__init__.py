"""The commands of `drake-navbench COMMAND`, one file each."""
