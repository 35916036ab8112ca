"""Initial states for a fit, from the data alone: spin phase, attitude (Wahba's problem), path."""
