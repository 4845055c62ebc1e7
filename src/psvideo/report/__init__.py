"""Every sentence that judges a take or a result, and the page that shows them.

``observe`` measures while a run goes on, ``judge`` turns measurements into sentences, ``judgement`` is the record of
one. ``run_report`` collects them; ``html``, ``style`` and ``over_time`` make the page. Of several takes:
``takes_report``, ``overview``. Of calibrations: ``rigs_report``, ``stood_still``.
"""
