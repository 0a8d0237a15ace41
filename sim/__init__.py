"""The phenomenon: cloth, wind, their simulation, and how it is seen."""
