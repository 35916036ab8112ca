"""What the sensors of a spinning body show before any fit: phases, slow signals, and what sound sensors agree in."""
