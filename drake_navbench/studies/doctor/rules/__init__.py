"""The rules of the doctor: one entry each, by what they look at."""
