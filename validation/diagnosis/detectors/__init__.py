"""Detectors of what no smooth parameter shows: events, gusts, dropped samples, clipping, ripple."""
