"""Scores of the blind test: answers against what was concealed."""
