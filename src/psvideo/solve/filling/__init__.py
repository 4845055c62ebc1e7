"""What fewer than three lights reach: a best estimate of normal and albedo, grown from what is solved around it."""
