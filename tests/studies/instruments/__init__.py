"""Two instruments of one wind that disagree: what of it is the anemometer's, its clock's, and the
flag's."""
