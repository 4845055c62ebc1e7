"""The records of ``model`` on disk, and files and folders that appear whole or not at all.

``plan_toml``, ``rig_toml``, ``timing_json``, ``clocks_json`` and ``flat_toml`` hold one record each; ``trace_csv`` the
edges of a real strobe; ``rig_folder`` the rigs of several takes, ``light_lists`` those of other programs;
``exr_files`` (through ``exr_stream``) and ``screen_pictures`` write pictures. ``contract`` is what all files with a
schema share, ``frame_rates`` how they write rates;
``whole_files`` and ``whole_folders`` write, ``free_folders`` knows where a run may write, ``written_files`` which of a
folder's files may be replaced, and ``paths`` checks what callers name.
"""
