"""Identification: which layout and settings the published tables speak for, and what they tell."""
