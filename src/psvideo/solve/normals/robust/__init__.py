"""The robust solver: least squares in which shadows and highlights weigh little. ``huber1981`` is the method,
``weighing`` holds its settings, and ``solution`` what it solves and where that goes.

``first_look`` finds what is typical of a picture, from a sample of its rows, where what moves leaves it
``sure_of_motion``; what stands speaks for all where it fits better than what moves. Then a block of pixels goes through
``robust_kernel``, in the memory of a ``room``:

1. ``explained``: plain least squares; pixels that it explains to their noise are done
2. ``apart``: the other pixels of a row are collected and solved together
3. ``robust_weights``: reweighting, by ``few_lights`` (up to nine) or ``any_lights``, with sums from ``equations``
4. ``odd_of_four``: which of four measurements that contradict each other is left out
5. ``predicted_error``: each normal's standard error
6. ``handing_out``: what was solved goes where the picture's results lie

Where a subject is not matte, ``reflectance`` takes points of it (``subject_points``), ``reflectance_fit`` finds which
kind of ``reflectance_model`` fits them (its loops are ``reflectance_kernel`` and ``point_sums``), and ``reflecting``
solves its pixels again with that, by what the model shows there (``reflected_light``) and gains
with the normal (``reflected_gain``).
"""
