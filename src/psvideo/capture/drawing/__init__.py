"""The diagram of a shoot: when each row is open and each light is on.

``diagram`` draws it, in three steps: ``timeline`` says what happens when, ``diagram_shapes`` where that is drawn, as
``shapes``; ``draw_svg``, ``draw_png`` and ``draw_text`` draw it.
"""
