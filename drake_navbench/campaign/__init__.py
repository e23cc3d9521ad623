"""Campaigns: the request, the table of trials, the workers that drive them, and the output."""
