"""The records of ``model`` on disk, and files and folders that appear whole or not at all.

- records: ``plan_toml``, ``rig_toml``, ``timing_json``, ``clocks_json``, ``flat_toml``; ``trace_csv``, the edges of a
  real strobe; ``light_lists``, rigs of other programs
- what files with a schema share: ``contract``, ``contract_mistakes`` (what is wrong with one, in words),
  ``separators`` (commas where points or spaces belong), ``frame_rates`` (how they write rates)
- places: ``clip_layout`` (a clip's plan and frames), ``rig_folder`` (the rigs of several takes), ``paths`` (what
  callers name)
- writing: ``whole_files`` and ``whole_folders``; ``free_folders`` (where a run may write), ``written_files`` (which of
  a folder's files may be replaced); pictures by ``exr_files``, through ``exr_stream``, and ``screen_pictures``
"""
