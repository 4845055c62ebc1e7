"""Plates of one round, which show different instants, brought to one instant; and what moves left out or averaged."""
