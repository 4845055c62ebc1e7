"""Commands over several takes: ``normals_of_takes``, ``split_of_takes``, ``check_folder``.

They share ``several_takes`` (a folder for each take, one report over all). ``cluster`` is many machines, and
``handed_out`` the work that they are given; ``arriving`` finds new takes in a folder while a set shoots.
"""
