"""The publication's tables and findings, and how our trials compare with them."""
