"""What sensors of one body say of one another before any motion is fitted (analytical redundancy)."""
