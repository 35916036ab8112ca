"""Which effects explain the recordings: candidates, score tests, stepwise selection by likelihood."""
