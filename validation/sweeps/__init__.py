"""Sweeps: many mounts, parts, fields or throws scored against truth, in chunks that survive whatever stops them."""
