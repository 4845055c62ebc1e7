"""Whole commands as functions: a clip in, a folder of files out, with the same checks as on the command line.

A module has the name of its command: ``normals``, ``split``, ``sync``, ``stills``, ``check``, ``view``, ``live``,
``demo``, ``doctor``, ``farm``, ``capture_plan``; ``calibrate`` and ``strobe`` are rooms. What they are made of:

- a run: ``caller`` (who hears of it), ``output``, ``lighting``, ``solving``, ``results``, ``plates``, ``delivering``,
  ``depths``, ``relit``, ``reporting``, ``handover``, ``previews``, ``look``
- in pieces and on many machines: ``pieces``, ``piece_notes``, ``cluster``
- several takes or cameras: ``several_takes``, ``normals_of_takes``, ``split_of_takes``, ``sync_cameras``
- photographs: ``light_sets``, ``still_rig``, ``still_doubts``, ``rti``
- on the set: ``checked``, ``check_folder``, ``takes``, ``live_sources``, ``live_strobe``, ``live_rehearsal``
- loops compiled ahead: ``compiling``, ``small_pictures``
"""
