"""What tests of several rooms share: recordings, logs and outcomes that they make."""
