"""What stands before the virtual camera: shapes, materials, and how they are rendered.

``meshes`` and ``shape`` are geometry, ``body`` places and moves it, ``material`` gives albedo; ``render`` casts
``rays`` and ``shading`` lights what they meet.
"""
