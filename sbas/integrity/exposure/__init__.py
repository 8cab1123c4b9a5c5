"""Risk between one sample, an hour and a mission, and the K factor that a target needs."""
