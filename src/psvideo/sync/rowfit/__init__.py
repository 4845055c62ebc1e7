"""The strobe's times from row profiles: one model of what rows see, searched coarsely, tracked, and sharpened."""
