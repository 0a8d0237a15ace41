"""flagdata: the lake of recordings and simulations of cloth in the wind, and the command line."""
