"""Logs of trials and folders of results."""
