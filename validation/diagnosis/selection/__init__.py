"""Which effects explain the recordings: stepwise selection by likelihood, and the evidence on what is held out."""
