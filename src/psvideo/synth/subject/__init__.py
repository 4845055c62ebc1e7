"""What stands before the virtual camera: shapes, materials, and how they are rendered."""
