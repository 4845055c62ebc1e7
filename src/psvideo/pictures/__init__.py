"""Pictures for eyes.

``quantity`` (any result), ``relighting`` with ``relit_kernel``, ``on_screen`` (light as pixels), ``contact`` sheets,
``charts``, ``timing_sheet``, and what was found on a ``mirror_sphere`` or a ``matte_sphere``.
"""
