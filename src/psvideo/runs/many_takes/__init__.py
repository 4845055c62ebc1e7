"""Commands over several takes: ``normals_of_takes``, ``split_of_takes``, ``check_folder``.

They share ``several_takes`` (a folder for each take, one report over all). ``cluster`` has takes solved by many
machines, and ``arriving`` finds new takes in a folder while a set shoots.
"""
