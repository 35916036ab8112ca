"""What long and short work share while it runs: recordings as they are given, tasks that survive an interruption."""
