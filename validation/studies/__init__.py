"""Pages about particular measured data."""
