"""Cases of the blind test: what is drawn, concealed, stated and masked, before anybody diagnoses."""
