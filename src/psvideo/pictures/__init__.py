"""Pictures for eyes.

``quantity`` (any result), ``relighting`` with ``relit_kernel``, ``contact`` sheets, ``charts``, ``timing_sheet``, and
what was found on a ``mirror_sphere`` or a ``matte_sphere``.
"""
