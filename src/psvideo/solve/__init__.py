"""Plates and a rig in, the surface out: normals, albedo, depth."""
