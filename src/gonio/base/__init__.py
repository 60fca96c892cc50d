"""The interfaces of reflectances, lights and measurements."""
