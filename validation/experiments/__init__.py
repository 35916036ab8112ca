"""Experiments on our own truth whose outcome is a judgement."""
