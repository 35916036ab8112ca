"""Runs that are killed, interrupted or doubled at random moments: what they leave, and what the next run makes of it.

``python -m tests.faults --kills 50 --seed N [--command NAME]``. A file appears whole or not at all, the run after it
ends well and gives the same bytes as one that nothing disturbed, and leaves no trace of the first.
"""
