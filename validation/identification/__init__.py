"""System identification: multiple shooting, linearisation, Gauss-Newton, noise and residual tests."""
