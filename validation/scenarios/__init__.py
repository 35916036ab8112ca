"""Runs on our own truth that others score with."""
