"""One ``course`` of the strobe through the whole take: ``track`` follows it from stretch to stretch, ``ends`` settles
what the take's first and last frames show.
"""
