"""Laws of no catalogue: power laws and spectral lines that explain what is left."""
