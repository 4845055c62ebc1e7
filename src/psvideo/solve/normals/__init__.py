"""From one plate per light to the surface. Every method is one module named by its paper: ``solve(...) -> Surface``.

``solving`` chooses the solver and calls it. Given to all: ``illumination`` (the lights), ``plate_noise``, ``task``
(arrays for compiled loops), ``bands`` (rows shared between threads), ``blocks`` (pixels side by side), ``measuring``
(samples to measurements), ``storing`` (results from blocks), ``near_kernel`` (near lights). Least squares:
``woodham1980``, in the loops of ``kernel``, ``grey_kernel`` and ``colour_kernel``. Robust: ``robust`` with the loops
of ``robust_kernel``; a block goes through ``explained``, ``few_lights`` or ``any_lights``, ``robust_weights``,
``odd_of_four``, ``equations``, ``apart`` and ``predicted_error``; then ``reflectance`` and ``reflecting`` for what is
not matte. Judged afterwards: ``evidence``, ``judging`` with ``judging_kernel``, ``doubting``, ``indirect``,
``near_spread``, ``moving_doubt``.
"""
