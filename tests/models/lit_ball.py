"""What several virtual shoots of the tests film: a grey ball in front of nothing, under three far lights."""

LIT_BALL = """\
[[light]]
name = "key"
direction = [0.5, 0.4, 0.8]
[[light]]
name = "left"
direction = [-0.6, 0.2, 0.8]
[[light]]
name = "top"
direction = [0.1, -0.5, 0.8]
[[object]]
mesh = "sphere"
albedo = 0.8
"""
