"""What a plan gives and what it costs: rates and shares of a shoot (``shoot_figures``), what rows and frames see of
its flashes (``rows_of_flashes``), what moves between two flashes (``motion_cost``), and what a strobe in step with
the camera misses (``in_step``).
"""
