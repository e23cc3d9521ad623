"""The commands of `drake-navbench COMMAND`, one file each.

Each imports only the standard library before its arguments are read, so that --help is quick.
"""
