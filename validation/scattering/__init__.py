"""Where throws land: Monte Carlo of release, coefficients and wind, with what each of them contributes."""
