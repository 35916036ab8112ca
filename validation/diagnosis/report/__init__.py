"""The report of a diagnosis: page, figures, wording, tables of the consistency stage."""
