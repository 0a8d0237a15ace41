"""The cloth of a drape test: scans of discs over a pedestal, simulated drapes, and the bending that fits."""
