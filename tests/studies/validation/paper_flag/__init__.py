"""A sheet filmed edge-on in a wind tunnel by others: measured, modelled and reported with what the
model lacked."""
