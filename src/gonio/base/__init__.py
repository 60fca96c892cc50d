"""The interfaces: what a reflectance, a light and a measurement are."""
