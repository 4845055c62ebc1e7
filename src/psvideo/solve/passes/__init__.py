"""What plates say beside normals and albedo: which lights reach a pixel, what is not diffuse, where a subject is."""
