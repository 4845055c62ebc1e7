"""The virtual camera: sensor, exposure, noise, transfer curve, files."""
