"""What is done to readings once they are numbers: order, defects, zero, averages."""
