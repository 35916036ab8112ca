"""Pictures of a flight in MuJoCo's viewer, live or offscreen."""
