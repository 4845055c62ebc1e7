"""What is measured on plates and surfaces while a run goes on, for its report.

``observed`` gathers all of it, round by round; a round's own numbers are its ``facts``, and those of all rounds
``kept_facts``. Each has a module: ``levels`` (exposure), ``hidden_level`` (of a sensor that saturates below the largest
code), ``motion``, ``focus``, ``shadow`` (what is left where no light reaches), ``steadiness``, ``worst`` (instants to
look at), over ``thinned`` pixels. Whether rig and curve are right, and whether photographs are aligned, are rooms of
their own: ``rig_and_curve``, ``alignment``.
"""
