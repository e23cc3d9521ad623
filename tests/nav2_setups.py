"""Whole Nav2 files as the tests read them."""

from __future__ import annotations

from drake_navbench.nav2.read_files import read_sections
from drake_navbench.nav2.robot import setup_of
from drake_navbench.nav2.substitutions import Substitutions


def read_nav2_files(paths, base, base_name, values=None, *, release=None, other_names=()):
    """Reads Nav2 files and merges them, as a run does; the last file that gives a parameter counts.

    base, base_name: the robot that supplies all that no file contains. values: for the files'
    substitutions; other_names: those that the files need not use.
    """
    substitutions = Substitutions(values or {})
    read = read_sections(paths, substitutions)
    substitutions.require_all_used(other_names)
    setup = setup_of(read, base, base_name, release=release)
    setup.require_columns()
    return setup
