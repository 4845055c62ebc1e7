"""Linear least squares: ``woodham1980`` is the method, ``kernel`` its loop, and ``grey_kernel`` the short way for
pixels of one channel, distant lights and no measurement missing."""
