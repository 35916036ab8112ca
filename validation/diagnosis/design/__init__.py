"""Experiment design: the next recordings, and which effects they would tell apart."""
