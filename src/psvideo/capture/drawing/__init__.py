"""The diagram of a shoot: when each row is open and each light is on."""
