"""Originals beside their ports, and builds of Nav2 beside each other."""
