"""Page, figures and document of the blind test."""
