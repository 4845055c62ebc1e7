"""Pictures for eyes: contact sheets, shading, charts, timing, spheres."""
