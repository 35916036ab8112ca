"""Candidate effects: hypotheses, the fit under one, score tests of what others would gain, and what evidence costs."""
