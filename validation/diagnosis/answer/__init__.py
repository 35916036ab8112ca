"""The parts of an answer: `named` what it names, `measured` what it measures, `checked` what may be written."""
