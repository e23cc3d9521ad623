"""Figures, from logs and trial tables: SVG and PNG, one colour a controller."""
