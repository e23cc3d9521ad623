"""The factor between a share and per cent."""

PERCENT = 100.0
