"""Which columns are a wind, whose it is, in which unit and direction, and which values are none."""
